"""What calibrations of a shot tell of its robot, from the metadata of their layers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from calmotion.model.uncertainty import KnownFactors
from calmotion.usd import stages

if TYPE_CHECKING:
    from pxr import Usd


def known_factors(stage: Usd.Stage) -> KnownFactors:
    """The factors that calibrations of a stage tell; of a parameter that several tell, the strongest layer's.

    Metadata that do not hold together, as of a layer that was edited by hand, tell nothing.
    """
    names: list[str] = []
    blocks: list[np.ndarray] = []
    for layer in stage.GetLayerStack():
        if stages.role_of(layer) != stages.CALIBRATION:
            continue
        entry: Any = layer.customLayerData.get(stages.METADATA_KEY, {}).get("calibration", {})
        own = [str(name) for name in entry.get("factors", ())]
        flat = np.array([float(value) for value in entry.get("covariance_of_log_factors", ())])
        if len(flat) != len(own) ** 2 or not len(own):
            continue
        covariance = flat.reshape(len(own), len(own))
        if not (np.all(np.isfinite(covariance)) and np.all(np.linalg.eigvalsh(covariance) > 0.0)):
            continue
        new = [k for k, name in enumerate(own) if name not in names]
        names += [own[k] for k in new]
        blocks.append(covariance[np.ix_(new, new)])
    total = np.zeros((len(names), len(names)))
    first = 0
    for block in blocks:
        total[first : first + len(block), first : first + len(block)] = block
        first += len(block)
    return KnownFactors(tuple(names), tuple(tuple(row) for row in total.tolist()))
