"""The animator's motor tracks as smooth curves, geared and delayed, and their values over a time grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array, IntArray
from calmotion.model.animation import Track
from calmotion.model.character import Character
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


def leaders(character: Character) -> IntArray:
    """Motors whose curves may change and follow no other; not those that are idle."""
    own = [motor.optimize and not motor.idle and motor.follows is None for motor in character.motors]
    return np.flatnonzero(own).astype(np.int32)


def coupling_of(character: Character, motors: IntArray) -> Array:
    """By how much each motor changes with each of `motors`, shape [M, m]."""
    coupling = np.zeros((len(character.motors), len(motors)))
    coupling[motors, np.arange(len(motors))] = 1.0
    for k, motor in enumerate(character.motors):
        if motor.follows is not None:
            coupling[k] = motor.follows.ratio * coupling[motor.follows.leader]
    return coupling


Maps: TypeAlias = "tuple[tuple[csr_matrix, csr_matrix], tuple[csr_matrix, csr_matrix]]"


@dataclass(frozen=True)
class CommandDelay:
    """The delays of all motors on one time grid.

    Attributes:
        delays: Of each motor [s].
        h: Step [s].
        cyclic: Whether the shot loops: instants 0 and 1 are then the last two, see `TimeGrid`.
    """

    delays: tuple[float, ...]
    h: float
    cyclic: bool

    def apply(self, values: Array, rates: Array) -> tuple[Array, Array]:
        """What the motors follow, from the values and rates of their curves, shape [T, M]."""
        if not any(self.delays):
            return values, rates
        parts = values.copy(), rates.copy()
        for motors, maps in self._groups(len(values)):
            for part, (of_value, of_rate) in zip(parts, maps, strict=True):
                part[:, motors] = of_value @ values[:, motors] + of_rate @ rates[:, motors]
        return parts

    def transposed(self, by_value: Array, by_rate: Array) -> tuple[Array, Array]:
        """The transpose of `apply`."""
        if not any(self.delays):
            return by_value, by_rate
        parts = by_value.copy(), by_rate.copy()
        for motors, (of_value, of_rate) in self._groups(len(by_value)):
            for k, part in enumerate(parts):
                part[:, motors] = of_value[k].T @ by_value[:, motors] + of_rate[k].T @ by_rate[:, motors]
        return parts

    def _groups(self, total: int) -> list[tuple[list[int], Maps]]:
        """Motors of the same delay, and its maps."""
        distinct = sorted({delay for delay in self.delays if delay > 0.0})
        return [
            ([m for m, delay in enumerate(self.delays) if delay == one], _maps(one, self.h, total, self.cyclic))
            for one in distinct
        ]


@lru_cache(maxsize=16)
def _maps(delay: float, h: float, total: int, cyclic: bool) -> Maps:
    """Value and rate of an instant from the values and the rates of all, shape [T, T] each."""
    at = np.arange(total) - delay / h
    rests = np.zeros(total, bool) if cyclic else at <= 0.0
    first = np.floor(at).astype(int)
    s = at - first
    if cyclic:
        # a loop of N steps has N + 2 instants, of which the first and the last two are the same
        first %= total - 2
    first = np.clip(first, 0, total - 2)
    values = 1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)
    rates = (6 * s**2 - 6 * s) / h, 1 - 4 * s + 3 * s**2, (6 * s - 6 * s**2) / h, 3 * s**2 - 2 * s
    rows = np.arange(total)

    def spread(near: Array, far: Array, resting: float) -> csr_matrix:
        near, far = np.where(rests, resting, near), np.where(rests, 0.0, far)
        columns = np.where(rests, 0, first), np.where(rests, 0, first + 1)
        entries = np.concatenate([near, far]), (np.concatenate([rows, rows]), np.concatenate(columns))
        return csr_matrix(entries, shape=(total, total))

    return (
        (spread(values[0], values[2], 1.0), spread(values[1], values[3], 0.0)),
        (spread(rates[0], rates[2], 0.0), spread(rates[1], rates[3], 0.0)),
    )
