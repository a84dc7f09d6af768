"""What calibrations of a shot tell of its robot, from the metadata of their layers."""

from typing import Any

import numpy as np
from pxr import Usd

from calmotion.model.uncertainty import KnownFactors
from calmotion.usd import stages


def known_factors(stage: Usd.Stage) -> KnownFactors:
    """The factors that calibrations of a stage tell, and how far these were off; the strongest layer's, if several do.

    Metadata that do not hold together, as of a layer that was edited by hand, tell nothing.
    """
    names: list[str] = []
    blocks: list[np.ndarray] = []
    largest = 0.0
    for layer in stage.GetLayerStack():
        if stages.role_of(layer) != stages.CALIBRATION:
            continue
        entry: Any = layer.customLayerData.get(stages.METADATA_KEY, {}).get("calibration", {})
        told = float(entry.get("prediction_largest_m", 0.0))
        largest = largest or (told if 0.0 < told < np.inf else 0.0)
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
    return KnownFactors(tuple(names), tuple(tuple(row) for row in total.tolist()), largest)


def predictions(stage: Usd.Stage) -> str | None:
    """How far recordings were from what the calibrated robot predicted of them, as a sentence for the user, from the
    strongest layer that tells it; None where none does."""
    for layer in stage.GetLayerStack():
        if stages.role_of(layer) == stages.CALIBRATION:
            entry: Any = layer.customLayerData.get(stages.METADATA_KEY, {}).get("calibration", {})
            rms, largest = (float(entry.get(f"prediction_{what}_m", 0.0)) for what in ("rms", "largest"))
            share = float(entry.get("prediction_share", 0.0))
            begin = f"{layer.GetDisplayName()}: the calibrated model"
            left = f"left {100.0 * share:.2g}% of the shake in its recordings" if 0.0 < share < np.inf else ""
            if 0.0 < rms < np.inf and rms <= largest < np.inf:
                return (
                    f"{begin} {left}{' and ' if left else ''}differed from its recordings by {1e3 * rms:.3g} mm (root "
                    f"mean square), {1e3 * largest:.3g} mm at most; expect at least that in addition to the errors in "
                    "this report"
                )
            if left:
                return (
                    f"{begin} {left}; expect at least this share of the errors as animated beside the errors in this "
                    "report"
                )
    return None
