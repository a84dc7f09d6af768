"""The animator's motor tracks as smooth curves, and their values over a time grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.model.animation import Track
from calmotion.model.curves import curve_of, held_curve
from calmotion.simulation.inputs.time_grid import ORDERS, TimeGrid, over_grid

PRE_ROLL = 1.0
AT_REST = 1e-3  # share of the shot's fastest motor below which a start counts as being at rest


@dataclass(frozen=True, eq=False)
class Curves:
    """Motor curves at the instants.

    Attributes:
        derivatives: Values [rad or m] and their first `ORDERS` - 1 derivatives by time, shape [T, M] each.
    """

    derivatives: tuple[Array, ...]

    @property
    def angles(self) -> Array:
        """Values [rad or m]."""
        return self.derivatives[0]

    @property
    def rates(self) -> Array:
        """[rad/s or m/s]."""
        return self.derivatives[1]

    @property
    def accelerations(self) -> Array:
        """[rad/s^2 or m/s^2]."""
        return self.derivatives[2]

    def plus(self, others: Sequence[Array]) -> Curves:
        """The sum with the derivatives of other curves."""
        return Curves(tuple(own + other for own, other in zip(self.derivatives, others, strict=True)))

    @classmethod
    def zero(cls, instants: int, motors: int) -> Curves:
        """Curves that are always zero."""
        return cls((np.zeros((instants, motors)),) * ORDERS)


def sample_curves(tracks: Sequence[Track], grid: TimeGrid) -> Curves:
    """Tracks at the grid's instants, pre-roll included."""
    if not tracks:
        return Curves.zero(len(grid.times), 0)
    columns = [over_grid(grid, curve_of(track, grid.end, grid.cyclic)) for track in tracks]
    return Curves(tuple(np.stack(parts, axis=1) for parts in zip(*columns, strict=True)))


def sample_tracks(tracks: Sequence[Track], grid: TimeGrid) -> tuple[Array, Array]:
    """Angles [rad] and rates [rad/s] of tracks at the grid's instants, shape [T, M]."""
    curves = sample_curves(tracks, grid)
    return curves.angles, curves.rates


def needed_pre_roll(tracks: Sequence[Track], frame_times: Array) -> float:
    """Length of the pre-roll [s] that a shot needs for its tracks: none when they start at rest, else a second."""
    end = frame_times[-1]
    fine = np.linspace(0.0, end, 4 * len(frame_times))
    start, fastest = 0.0, 0.0
    for track in tracks:
        rate = held_curve(track, end)(fine, 1)
        start, fastest = max(start, abs(rate[0])), max(fastest, float(np.max(np.abs(rate))))
    return 0.0 if start <= AT_REST * fastest else PRE_ROLL
