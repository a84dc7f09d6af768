"""The JSON report of a calibration."""

import math
from typing import Any

from calmotion.model import WrittenLayer
from calmotion.version import __version__
from calmotion.workflow import plain

from ..model.estimates import WITH_THIS_MODEL_ONLY, Calibration


def calibration_report(
    calibration: Calibration, layer: WrittenLayer | None, figures: tuple[str, ...], total_wall_s: float
) -> dict[str, Any]:
    """The object that `calibrate --json` prints: plain values, keys as in the USD contract."""
    report: dict[str, Any] = plain(
        {
            "command": "calibrate",
            "html": None,  # a page has words of this report, and is written after it
            "version": __version__,
            "parameters": [
                {
                    "name": item.name,
                    "kind": item.kind,
                    "path": item.path,
                    "unit": item.unit,
                    "value": item.value,
                    "standard_deviation": item.standard_deviation,
                    "prior": {"value": item.nominal, "standard_deviation": item.prior},
                    "identifiable": WITH_THIS_MODEL_ONLY if item.disagrees else item.identifiable,
                    "of_robot": item.of_robot,
                    "advice": item.advice,
                }
                for item in calibration.estimates
            ],
            "correlations": calibration.correlations.tolist(),
            "channels": [
                {
                    "recording": fit.recording,
                    "name": fit.name,
                    "unit": fit.unit,
                    "samples": fit.samples,
                    "held_out": fit.held_out,
                    "noise": fit.sigma,
                    "rms_before": fit.rms_before,
                    "rms": fit.rms,
                    "validation_rms": _known(fit.validation_rms),
                    "outliers": fit.outliers,
                }
                for fit in calibration.channels
            ],
            "residual_rms": {fit.name: fit.rms for fit in calibration.channels},
            "validation_rms": {fit.name: _known(fit.validation_rms) for fit in calibration.channels},
            "recordings": [{"file": file, "sha256": digest} for file, digest in calibration.recordings.items()],
            "converged": calibration.converged,
            "interrupted": calibration.interrupted,
            "iterations": calibration.iterations,
            "simulations": calibration.simulations,
            "step_s": calibration.step_s,
            "step_shift": calibration.step_shift,
            "wall_s": calibration.wall_s,
            "total_wall_s": total_wall_s,
            "layer": None if layer is None else layer.layer,
            "root": None if layer is None else layer.root,
            "figures": figures,
            "notes": calibration.notes,
        }
    )
    return report


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
