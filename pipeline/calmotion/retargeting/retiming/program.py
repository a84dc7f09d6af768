"""The stretch of an animation that keeps the limits of the motors and adds the least time (formulation, section 11).

With sigma(s) = dT/ds as a quadratic spline with coefficients c, rates are theta'/sigma, accelerations
theta''/sigma^2 - theta' sigma'/sigma^3, jerks their derivative, and efforts g + A/sigma^2 - B sigma'/sigma^3. They are
linearised, and quadratic programs are solved one after the other within a trust region.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix, diags, eye_array, hstack, vstack

from calmotion.arrays import Array
from calmotion.retargeting.retiming.splines import StretchBasis
from calmotion.retargeting.solver.elastic_program import elastic_minimum
from calmotion.simulation.inputs.tempo import MotorEfforts, TempoLimits

DEVIATION = 1e-2  # weight of int (sigma - 1)^2, over that of the time that is added
EXCEEDED = 30.0  # what an excess of a limit by itself at one instant costs, or a pin by a second [s]
WITHIN = 5e-4  # share of a limit by which the tempo stays within it
NEAR = 0.4  # share of a limit from which on it may come to act in one step
FIRST_RADIUS, LEAST_RADIUS = 0.3, 1e-6  # of the trust region: change of a coefficient
CONVERGED = 1e-7  # decrease of the merit that ends the iteration [s]
MOST_STEPS = 60
NOTICED = 1e-3  # share of a limit that counts as exceeded; seconds by which a pin counts as missed


@dataclass(frozen=True, eq=False)
class Path:
    """What limits the tempo, at S instants of the animation for M motors.

    Attributes:
        derivatives: First, second and third ones of the motors' curves by the animation's time, shape [S, M] each.
        limits: Of the motors.
        efforts: Of the rigid robot; None where none is limited.
    """

    derivatives: tuple[Array, Array, Array]
    limits: TempoLimits
    efforts: MotorEfforts | None


@dataclass(frozen=True, eq=False)
class Duration:
    """A part of the animation whose performance takes a given time [s]."""

    start: float
    end: float
    length: float


@dataclass(frozen=True, eq=False)
class Term:
    """A quantity by a stretch, as a share of its limit, and its derivatives by sigma, sigma', sigma''; shape [S, M]."""

    quantity: str
    value: Array
    slopes: tuple[Array, Array, Array]


@dataclass(frozen=True, eq=False)
class TempoProgram:
    """The program.

    Attributes:
        basis: Of the stretch.
        path: What limits it, at the basis' instants.
        slowest, fastest: Largest and smallest stretch.
        scale: Time L within which the tempo changes [s]: the cost has int (L^2 sigma'')^2.
        durations: Parts that take a given time.
        weights: Of each coefficient's deviation from 1, shape [n].
    """

    basis: StretchBasis
    path: Path
    slowest: float
    fastest: float
    scale: float
    durations: tuple[Duration, ...] = ()
    weights: Array | None = None

    def solve(self, start: Array) -> Array:
        """The coefficients of the stretch, from others of shape [n]; limits that cannot be kept are exceeded least."""
        c = np.clip(start, self.fastest, self.slowest)
        radius, merit = FIRST_RADIUS, self._merit(c)
        for _ in range(MOST_STEPS):
            step = self._step(c, radius)
            tried = np.clip(c + step, self.fastest, self.slowest)
            better = self._merit(tried)
            if better < merit:
                gained, c, merit = merit - better, tried, better
                if gained <= CONVERGED:
                    break
                radius = min(2.0 * radius, 1.0)
            else:
                radius = 0.25 * min(radius, float(np.max(np.abs(step))))
            if radius < LEAST_RADIUS:
                break
        return c

    def terms(self, c: Array) -> Iterator[Term]:
        """The quantities that are limited, at a stretch."""
        limits, (first, second, third) = self.path.limits, self.path.derivatives
        s, r, b = (matrix @ c for matrix in self._matrices)
        s, r, b = s[:, None], r[:, None], b[:, None]
        none = np.zeros_like(first)
        if np.any(np.isfinite(limits.velocity)):
            yield _term("velocity", limits.velocity, first / s, (-first / s**2, none, none))
        for name, largest, rest, square, change in self._forces(none):
            value = rest + square / s**2 - change * r / s**3
            slopes = -2.0 * square / s**3 + 3.0 * change * r / s**4, -change / s**3, none
            yield _term(name, largest, value, slopes)
        if np.any(np.isfinite(limits.jerk)):
            value = third / s**3 - 3.0 * second * r / s**4 + first * (3.0 * r**2 / s**5 - b / s**4)
            by_stretch = -3.0 * third / s**4 + 12.0 * second * r / s**5 - first * (15.0 * r**2 / s**6 - 4.0 * b / s**5)
            yield _term(
                "jerk", limits.jerk, value, (by_stretch, -3.0 * second / s**4 + 6.0 * first * r / s**5, -first / s**4)
            )

    def _forces(self, none: Array) -> Iterator[tuple[str, Array, Array, Array, Array]]:
        """Accelerations and efforts: the limit, what is there at rest, and what multiplies the square of the tempo and
        half of its change."""
        limits, (first, second, _), efforts = self.path.limits, self.path.derivatives, self.path.efforts
        if np.any(np.isfinite(limits.acceleration)):
            yield "acceleration", limits.acceleration, none, second, first
        if efforts is not None:
            yield "effort", limits.effort, efforts.at_rest, efforts.by_square, efforts.by_change

    def excess(self, c: Array) -> float:
        """By how much a limit is exceeded at most, as a share of it, and a duration is missed at most [s]."""
        over = [float(np.max(np.abs(term.value), initial=0.0)) - 1.0 for term in self.terms(c)]
        return max([0.0, *over, self.missed(c)])

    def missed(self, c: Array) -> float:
        """By how much a duration is missed at most [s]."""
        return float(np.max(np.abs(self._integrals @ c - self._lengths), initial=0.0))

    def _merit(self, c: Array) -> float:
        over = sum(float(np.sum(np.maximum(np.abs(term.value) - 1.0 + WITHIN, 0.0))) for term in self.terms(c))
        missed = float(np.sum(np.abs(self._integrals @ c - self._lengths)))
        slower = float(self._means @ np.maximum(c - 1.0, 0.0))
        d = c - 1.0
        return slower + 0.5 * float(d @ (self._quadratic @ d)) + EXCEEDED * (over + missed)

    def _step(self, c: Array, radius: float) -> Array:
        """The change of the coefficients by the quadratic program at a point."""
        n = len(c)
        identity = eye_array(n, format="csr")
        # what is added by each coefficient is a variable of its own: max(sigma - 1, 0)
        rows, room = [hstack([identity, -identity]), hstack([csr_matrix((n, n)), -identity])], [1.0 - c, np.zeros(n)]
        least, most = np.maximum(self.fastest - c, -radius), np.minimum(self.slowest - c, radius)
        for matrix, bound in ((identity, most), (-identity, -least), *self._linearized(c)):
            rows.append(hstack([matrix, csr_matrix((matrix.shape[0], n))]))
            room.append(bound)
        quadratic = vstack(
            [hstack([self._quadratic, csr_matrix((n, n))]), hstack([csr_matrix((n, n)), 1e-9 * identity])]
        )
        linear = np.concatenate([self._quadratic @ (c - 1.0), self._means])
        found = elastic_minimum(csr_matrix(quadratic), linear, csr_matrix(vstack(rows)), np.concatenate(room), EXCEEDED)
        return found.x[:n]

    def _linearized(self, c: Array) -> Iterator[tuple[csr_matrix, Array]]:
        """`rows d <= room` of the limits that may act, and of the durations."""
        for term in self.terms(c):
            for sign in (1.0, -1.0):
                # a bent stretch has jerks anywhere
                instants, motors = np.nonzero(sign * term.value > (-np.inf if term.quantity == "jerk" else NEAR))
                matrix = csr_matrix((len(instants), len(c)))
                for slope, basis in zip(term.slopes, self._matrices, strict=True):
                    matrix = matrix + diags(sign * slope[instants, motors]) @ basis[instants]
                yield csr_matrix(matrix), 1.0 - WITHIN - sign * term.value[instants, motors]
        missed = self._lengths - self._integrals @ c
        for sign in (1.0, -1.0):
            yield csr_matrix(sign * self._integrals), sign * missed

    @cached_property
    def _matrices(self) -> tuple[csr_matrix, csr_matrix, csr_matrix]:
        return self.basis.matrices(self.basis.times)

    @cached_property
    def _means(self) -> Array:
        """Integral of each spline over the animation [s]."""
        return self.basis.integral(*self.basis.breaks[[0, -1]])

    @cached_property
    def _integrals(self) -> Array:
        rows = [self.basis.integral(part.start, part.end) for part in self.durations]
        return np.array(rows).reshape(-1, self.basis.count)

    @cached_property
    def _lengths(self) -> Array:
        return np.array([part.length for part in self.durations])

    @cached_property
    def _quadratic(self) -> csr_matrix:
        """Second derivatives of the cost by the coefficients [s]."""
        middles = 0.5 * (self.basis.breaks[1:] + self.basis.breaks[:-1])
        bending = self.basis.matrices(middles)[2]
        width = np.diff(self.basis.breaks)
        bent = bending.T @ diags(self.scale**4 * width) @ bending
        weights = np.ones(self.basis.count) if self.weights is None else self.weights
        return csr_matrix(diags(DEVIATION * weights * self._means) + bent)


def _term(name: str, largest: Array, value: Array, slopes: tuple[Array, Array, Array]) -> Term:
    return Term(name, value / largest, (slopes[0] / largest, slopes[1] / largest, slopes[2] / largest))
