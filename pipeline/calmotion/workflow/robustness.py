"""What reports say of curves on robots that differ from the model."""

from __future__ import annotations

from typing import Any

import numpy as np

from calmotion.model import Result
from calmotion.model.robust.robots import CURVES


def robustness_row(result: Result, target: int) -> dict[str, Any]:
    """The errors of a target on robots that differ from the model, for each set of curves; empty without `--robust`."""
    found = result.robustness
    if found is None:
        return {}
    rows = {}
    for name in CURVES:
        drawn = found.drawn[name][:, target]
        rows[name] = {
            "nominal_max_error_m": float(found.nominal[name][target]),
            "median_max_error_m": float(np.median(drawn)),
            "p95_max_error_m": float(np.quantile(drawn, 0.95, method="higher")),
            "worst_max_error_m": float(drawn.max()),
        }
    return {"robustness": rows}


def robustness_report(result: Result) -> dict[str, Any]:
    """The robots of a robust search and of its measurement, and the trade-off; empty without `--robust`."""
    found = result.robustness
    if found is None:
        return {}
    return {
        "robust": found.kind,
        "scenarios": [{"parameters": dict(s.factors), "weight": s.weight} for s in found.scenarios],
        "draws": len(found.drawn["robust"]),
        "tradeoff": [
            {
                "nominal_weight": row.weight,
                "nominal_allowed_m": row.allowed,
                "nominal_max_error_m": row.nominal.tolist(),
                "p95_max_error_m": np.quantile(row.drawn, 0.95, axis=0, method="higher").tolist(),
                "worst_max_error_m": row.drawn.max(axis=0).tolist(),
            }
            for row in found.compromises
        ],
        "failed_draws": {name: int(np.sum(~np.isfinite(found.drawn[name]).all(axis=1))) for name in CURVES},
    }
