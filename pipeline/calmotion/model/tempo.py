"""The tempo of a performance: when it has what the animation has at each of its times."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from calmotion.arrays import Array

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

NEWTON_STEPS = 50  # at most; four are enough but where the tempo changes by much between two pairs
EXACT = 1e-14  # of the length of the performance: what is nearer is the same time


@dataclass(frozen=True, eq=False)
class TimeMap:
    """Times of an animation and of its performance, with the cubic interpolant (not-a-knot) between these pairs.

    Before and after them, the tempo stays as it is there.

    Attributes:
        animation: [s] after the first frame, strictly increasing, first 0, shape [n], n >= 4.
        performance: When the performance is there [s], likewise.
    """

    animation: Array
    performance: Array

    @cached_property
    def _spline(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.animation, self.performance)

    @property
    def added(self) -> float:
        """By how much the performance is longer [s]."""
        return float(self.performance[-1] - self.animation[-1])

    def performed(self, times: Array) -> Array:
        """When the performance is where the animation is at some times, T(s) [s]."""
        inside = np.clip(times, self.animation[0], self.animation[-1])
        return np.asarray(self._spline(inside) + (times - inside) * self._spline(inside, 1))

    def stretch(self, times: Array) -> Array:
        """dT/ds at times of the animation."""
        return np.asarray(self._spline(np.clip(times, self.animation[0], self.animation[-1]), 1))

    def animated(self, times: Array) -> Array:
        """The inverse of `performed`: times of the animation at times of the performance [s]."""
        first, last = self.animation[[0, -1]]
        fine = np.linspace(first, last, 8 * len(self.animation))
        found = np.interp(times, self._spline(fine), fine)
        for _ in range(NEWTON_STEPS):
            off = self.performed(found) - times
            if np.max(np.abs(off), initial=0.0) <= EXACT * self.performance[-1]:
                break
            found = found - off / self.stretch(found)
        return np.asarray(found)


@dataclass(frozen=True)
class TempoSettings:
    """How the tempo may change.

    Attributes:
        slowest, fastest: Largest and smallest stretch; below 1 parts may be faster than they are animated.
        pinned: Times of the animation whose distances in the performance are the same [s].
    """

    slowest: float = 2.0
    fastest: float = 1.0
    pinned: tuple[float, ...] = ()


@dataclass(frozen=True)
class Stretch:
    """A part of the animation that is performed at another tempo.

    Attributes:
        start, end: [s].
        factor: How many times as long it takes.
        because: Motors and quantities whose limits are reached there: index, name of the kind of limit.
    """

    start: float
    end: float
    factor: float
    because: tuple[tuple[int, str], ...]


@dataclass(frozen=True)
class TempoReport:
    """What the tempo of a performance costs.

    Attributes:
        uniform_added: What one tempo for the whole would add, for the limits of motors on rigid links [s]; infinite
            where a motor is too weak to hold a pose.
        lower_bound: What is added at least for them, where only what must is slower [s].
        stretches: Parts of another tempo.
        pins: Pinned times of the animation, and by how much they are later in the performance [s].
        lacking: Largest stretch that limits ask for where less is allowed; 0 where what is allowed does.
    """

    uniform_added: float
    lower_bound: float
    stretches: tuple[Stretch, ...]
    pins: tuple[tuple[float, float], ...]
    lacking: float = 0.0
