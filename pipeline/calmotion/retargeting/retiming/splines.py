"""Quadratic splines of the stretch: their coefficients bound it, and its integral is the performance's time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import csr_matrix, diags, eye_array

from calmotion.arrays import Array
from calmotion.model.tempo import TimeMap

DEGREE = 2
INSTANTS = np.linspace(1e-6, 1.0 - 1e-6, 5)  # of an interval, where limits are kept: jerks jump at knots


@dataclass(frozen=True, eq=False)
class StretchBasis:
    """n - 1 equal intervals over an animation, and the n + 1 B-splines on them.

    Attributes:
        breaks: Knots [s], shape [n].
    """

    breaks: Array

    @classmethod
    def over(cls, length: float, distance: float) -> StretchBasis:
        """Knots at most some distance apart [s], three intervals at least."""
        return cls(np.linspace(0.0, length, max(3, int(np.ceil(length / distance - 1e-9))) + 1))

    @property
    def count(self) -> int:
        """Number of coefficients."""
        return len(self.breaks) + 1

    @cached_property
    def _knots(self) -> Array:
        first, last = self.breaks[[0, -1]]
        return np.concatenate([np.full(DEGREE, first), self.breaks, np.full(DEGREE, last)])

    @cached_property
    def times(self) -> Array:
        """Instants at which limits are kept [s], shape [S]."""
        return np.asarray((self.breaks[:-1, None] + np.diff(self.breaks)[:, None] * INSTANTS).ravel())

    @property
    def centres(self) -> Array:
        """Where each spline is largest, or acts alone [s], shape [n + 1]."""
        return np.concatenate([self.breaks[:1], 0.5 * (self.breaks[1:] + self.breaks[:-1]), self.breaks[-1:]])

    def matrices(self, times: Array) -> tuple[csr_matrix, csr_matrix, csr_matrix]:
        """The splines and their first two derivatives at some times, shape [S, n + 1] each."""
        found, knots, coefficients = [], self._knots, eye_array(self.count, format="csr")
        for degree in (2, 1, 0):
            at = BSpline.design_matrix(np.clip(times, knots[0], knots[-1]), knots, degree)
            found.append(csr_matrix(at @ coefficients))
            if degree:  # derivatives are splines of a degree less, by differences of the coefficients
                width = knots[degree + 1 : -1] - knots[1 : -degree - 1]
                change = coefficients[1:] - coefficients[:-1]
                coefficients, knots = csr_matrix(diags(degree / width) @ change), knots[1:-1]
        return found[0], found[1], found[2]

    def integral(self, start: float, end: float) -> Array:
        """Integral of each spline over a part of the animation [s], shape [n + 1]."""
        knots = self._knots
        widths = (knots[DEGREE + 1 :] - knots[: -DEGREE - 1]) / (DEGREE + 1)
        # splines of a degree more, whose coefficients are sums of these times the widths
        higher = np.concatenate([knots[:1], knots, knots[-1:]])
        first, last = BSpline.design_matrix(np.array([start, end]), higher, DEGREE + 1).toarray()
        return np.asarray(widths * np.cumsum((last - first)[::-1])[-2::-1])

    def time_map(self, coefficients: Array) -> TimeMap:
        """The performance's time. The middles of both outer intervals are among its pairs, so that its interpolant with
        not-a-knot ends has its knots where the stretch has."""
        middles = 0.5 * (self.breaks[[0, -2]] + self.breaks[[1, -1]])
        times = np.sort(np.concatenate([self.breaks, middles]))
        performance = BSpline(self._knots, coefficients, DEGREE).antiderivative()
        return TimeMap(times, np.asarray(performance(times) - performance(times[0])))
