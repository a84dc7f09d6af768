"""The beginning of a shot in which all curves are locked: nothing of it has to be linearised."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from calmotion.arrays import BoolArray
from calmotion.retargeting.problem.adaptive_knots import halved
from calmotion.retargeting.problem.offset_basis import OffsetBasis
from calmotion.simulation.inputs.time_grid import TimeGrid

FixedOn = Callable[[OffsetBasis], BoolArray]


def first_change(grid: TimeGrid, basis: OffsetBasis, fixed_on: FixedOn) -> int:
    """Index of an instant before which only fixed coefficients act, on these knots and on the next finer ones.

    Args:
        fixed_on: Maps a basis to its fixed coefficients, shape [n], bool.
    """

    def start_on(on: OffsetBasis) -> float:
        free = ~np.all(fixed_on(on).reshape(on.count, -1), axis=1)
        return float(np.min(on.support[free, 0], initial=grid.end))

    start = 0.0 if grid.cyclic else start_on(basis)
    if start > 0.0:
        start = min(start, start_on(basis.on(grid, halved(grid, basis.breaks))))
    if not start > 0.0:
        return 0
    return min(int(np.searchsorted(grid.times, start - 0.5 * grid.h)), len(grid.times) - 2)
