"""Errors at targets in metres as they weigh: positions and rotations of targets apart, at some of the instants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.target_errors import Objective

Rows = TypeVar("Rows", NDArray[np.float64], NDArray[np.float32])
_ENTRIES, _OPERATIONS = 1.5e8, 1e11  # most derivatives by all unknowns, and operations of their matrix of products
_SPARSEST = 0.0125  # most time between two instants [s]


@dataclass(frozen=True, eq=False)
class WeightedErrors:
    """Where errors are taken, and how they weigh; a group is the position or the rotation of a target.

    Attributes:
        units: Weighted residuals of an error of one metre of the group that weighs most, shape [T].
        at: The instants, shape [t].
        places: Which groups weigh, among position and rotation of each target in turn, shape [G].
        scale: Of half the squared largest error in the objective: the integral of the weight.
        dense_enough: Whether the instants are as near as errors are fast.
    """

    units: Array
    at: IntArray
    places: IntArray
    scale: float
    dense_enough: bool

    @classmethod
    def of_objective(cls, objective: Objective, grid: TimeGrid, robots: int, unknowns: int) -> WeightedErrors:
        """The errors of an objective, at so few instants that the derivatives of all robots can be stored.

        Args:
            objective: Of one robot.
            grid: Its time grid.
            robots: Their number.
            unknowns: Of the search.
        """
        squares = objective.weights.reshape(len(grid.times), -1, 2, 3)[..., 0] ** 2
        by_time = np.where(grid.quadrature > 0.0, grid.quadrature, grid.h)
        largest = float((squares / by_time[:, None, None]).max())
        flat = squares.reshape(len(squares), -1)
        places, judged = (np.flatnonzero(flat.any(axis=k)).astype(np.int32) for k in (0, 1))
        rows = 3.0 * robots * len(judged) * len(places)
        every = max(1, int(np.ceil(max(rows * unknowns / _ENTRIES, 2.0 * rows * unknowns**2 / _OPERATIONS))))
        scale = largest * float(grid.quadrature.sum()) * len(places)
        return cls(np.sqrt(largest * by_time), judged[::every], places, scale, grid.h * every <= _SPARSEST)

    @property
    def of_position(self) -> BoolArray:
        """Which groups are positions, shape [G]."""
        return np.asarray(self.places % 2 == 0)

    def of(self, residuals: Array) -> Array:
        """Errors of weighted residuals of shape [T, K, 6], shape [t, G, 3] [m]."""
        return self.thinned(residuals[self.at][..., None])[..., 0]

    def thinned(self, rows: Rows) -> Rows:
        """The same of rows at the instants alone, such as derivatives, shape [t, K, 6, n] to [t, G, 3, n]."""
        units = self.units[self.at][:, None, None, None].astype(rows.dtype)
        scaled: Rows = rows.reshape(len(rows), -1, 3, rows.shape[3])[:, self.places]
        scaled /= units
        return scaled
