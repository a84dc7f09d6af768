"""The delay of commands: what a compliant motor follows is its curve of some time ago.

Between instants a curve is the cubic with the values and rates of both, which is exact for splines with knots at
instants. Before a shot begins the robot rests at its first command; a shot that loops has its end before its beginning.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array

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
