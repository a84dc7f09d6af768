"""The tempo of results that a shot carries."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model.retiming.tempo import TimeMap
from calmotion.usd.clock import Clock
from calmotion.usd.reading.context import prims_of

if TYPE_CHECKING:
    from pxr import Usd

MAP = "calm:retime:map"
_FEWEST = 4  # pairs, through which a cubic goes


def retime_map(composed: Usd.Stage) -> Array | None:
    """Time codes of the animation and of the performance, shape [n, 2]; None where no result has another tempo.

    Raises:
        ShotError: They are no times of a performance.
    """
    for prim in prims_of(composed):
        attribute = prim.GetAttribute(MAP)
        if attribute and attribute.HasAuthoredValue() and attribute.Get() is not None:
            pairs = np.array(attribute.Get(), dtype=np.float64).reshape(-1, 2)
            rises = (
                len(pairs) >= _FEWEST
                and bool(np.all(np.isfinite(pairs)))
                and bool(np.all(np.diff(pairs, axis=0) > 0.0))
            )
            if not rises:
                raise ShotError(
                    "these are no times of an animation and of its performance", path=str(prim.GetPath()),
                    attribute=MAP, found=f"{len(pairs)} pairs",
                    remedy="Optimise the shot beneath once more with --retime: they are four or more, and ascend",
                )  # fmt: skip
            return pairs
    return None


def tempo_of(clock: Clock, pairs: Array | None) -> tuple[TimeMap | None, Clock]:
    """The tempo that pairs of time codes mean, and the clock of the performance.

    Args:
        clock: Of the animation.
        pairs: Shape [n, 2]; None: it is performed at its own tempo.
    """
    if pairs is None:
        return None, clock
    animation, performance = (clock.seconds(column) for column in pairs.T)
    return TimeMap(animation, performance), dataclasses.replace(clock, end=float(pairs[-1, 1]))
