"""Levenberg-Marquardt with a normal prior, bounds, and a loss that outliers cannot dominate.

    min_z  sum_i rho(r_i(z)) / n_i + 1/2 z^T z

where rho is Huber's loss: quadratic up to `HUBER`, linear beyond. n_i successive residuals count as one: where they are
correlated in time, as those of a model that misses something, they do not outweigh the prior. Each iteration weighs a
residual r beyond `HUBER` by HUBER / |r| (iteratively reweighted least squares). Entries of z at a bound that would
leave it are held there.

Source: Nocedal, Wright, Numerical Optimization, 2006, section 10.3; Huber, Robust Statistics, 1981.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from calmotion.arrays import Array, BoolArray
from calmotion.support import answer

HUBER = 3.0  # standard deviations: few residuals of a normal distribution are larger
ENOUGH = 1e-2  # change of z, in standard deviations of its posterior, at which a search ends
MOST = 30  # iterations
RISEN = 1.0  # loss that a step by another minimum's derivatives may add: less than a standard deviation or two
FIRST = 1e-3  # damping, relative to the diagonal of the Gauss-Newton matrix
STALLED = 0.1  # of the change at which a search ends: a damped step that is shorter tells that no step lowers the loss
NEARLY = 0.1  # change that is left, in standard deviations, with which such a search has converged all the same


class Problem(Protocol):
    """Residuals over their standard deviations, shape [N], and their derivative by z, shape [N, n]."""

    @property
    def counts(self) -> Array:
        """How many successive residuals count as one, shape [N]."""

    def residuals(self, z: Array) -> Array | None:
        """At z; None where there is no value."""

    def linearized(self, z: Array) -> tuple[Array, Array]:
        """With their derivative."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A minimum.

    Attributes:
        z: Where, shape [n].
        residuals: There, shape [N].
        jacobian: Derivative of the residuals, shape [N, n].
        cost: Loss and prior.
        iterations: Number of linearisations.
        converged: Whether the last step was small, rather than that the iterations ended.
        interrupted: Whether the user ended them.
    """

    z: Array
    residuals: Array
    jacobian: Array
    cost: float
    iterations: int
    converged: bool
    interrupted: bool = False


def weights_of(residuals: Array) -> Array:
    """Weights of the residuals, 1 or less, shape [N]."""
    size = np.abs(residuals)
    return np.where(size > HUBER, HUBER / np.maximum(size, HUBER), 1.0)


def loss_of(residuals: Array, counts: Array | float = 1.0) -> float:
    """Sum of Huber's loss, of residuals of which so many count as one."""
    size = np.abs(residuals)
    return float((np.where(size > HUBER, HUBER * (size - 0.5 * HUBER), 0.5 * size**2) / counts).sum())


def minimize(problem: Problem, start: Array, lower: Array, most: int = MOST, enough: float = ENOUGH) -> Solution:
    """The minimum that is reached from a start; after an interrupt the last place that has derivatives.

    Args:
        problem: Its residuals.
        start: Shape [n]; the residuals have a value there.
        lower: Least value of each entry, shape [n].
        most: Largest number of iterations.
        enough: Change of z, in standard deviations of its posterior, at which the search ends.

    Raises:
        ValueError: The residuals have no value at the start.
        KeyboardInterrupt: Before there is any.
    """
    known: list[Solution] = []
    try:
        return _minimized(problem, start, lower, most, enough, known)
    except KeyboardInterrupt:
        if not known:
            raise
        answer()
        return replace(known[-1], interrupted=True)


def _minimized(
    problem: Problem, start: Array, lower: Array, most: int, enough: float, known: list[Solution]
) -> Solution:
    z, counts = np.maximum(start, lower), problem.counts
    damping = FIRST
    for iteration in range(1, most + 1):
        r, J = problem.linearized(z)
        cost = loss_of(r, counts) + 0.5 * float(z @ z)
        known[:] = [Solution(z, r, J, cost, iteration, False)]
        w = weights_of(r) / counts
        H = J.T @ (w[:, None] * J) + np.eye(len(z))
        gradient = J.T @ (w * r) + z
        free = ~((z <= lower) & (gradient > 0.0))
        own = H[np.ix_(free, free)]
        left = _size(_step(own, gradient, free, z, lower, 0.0), H)  # to the minimum, by this derivative
        known[:] = [replace(known[-1], converged=left < enough)]
        if left < enough:
            return known[-1]
        while True:
            taken = _step(own, gradient, free, z, lower, damping)
            then = z + taken
            if _size(taken, H) < STALLED * enough:
                # shorter and shorter steps add to the loss: its derivative is another one close by
                return replace(known[-1], converged=left < NEARLY)
            tried = problem.residuals(then)
            after = np.inf if tried is None else loss_of(tried, counts) + 0.5 * float(then @ then)
            if after <= cost:
                expected = -(gradient @ taken + 0.5 * taken @ H @ taken)
                gain = (cost - after) / expected if expected > 0.0 else 1.0
                damping = max(damping * (0.1 if gain > 0.75 else 1.0 if gain > 0.25 else 4.0), 1e-12)
                z = then
                break
            damping *= 10.0  # not back to the first: along a narrow bent valley steps need little of it
    r, J = problem.linearized(z)
    return Solution(z, r, J, loss_of(r, counts) + 0.5 * float(z @ z), most, False)


def _step(H: Array, gradient: Array, free: BoolArray, z: Array, lower: Array, damping: float) -> Array:
    """A step to the minimum from z, within the bounds, by the Gauss-Newton matrix of the free entries."""
    step = np.zeros_like(z)
    step[free] = -np.linalg.solve(H + damping * np.diag(np.diag(H)), gradient[free])
    return np.maximum(z + step, lower) - z


def _size(step: Array, H: Array) -> float:
    """In standard deviations of the posterior."""
    return float(np.sqrt(step @ H @ step))


def chord(problem: Problem, known: Solution, most: int = 8) -> Solution | None:
    """The minimum of a problem near that of another one, with the derivatives of the other one; None where these lead
    to more loss, or to no end.

    Args:
        problem: Its residuals.
        known: The other minimum, which is returned where the problem has no value there.
        most: Largest number of steps.
    """
    z, J, r = known.z, known.jacobian, problem.residuals(known.z)
    if r is None:
        return known
    cost = _cost(problem, z, r)
    for _ in range(most):
        w = weights_of(r) / problem.counts
        H = J.T @ (w[:, None] * J) + np.eye(len(z))
        step = -np.linalg.solve(H, J.T @ (w * r) + z)
        if float(np.sqrt(step @ H @ step)) < ENOUGH:
            return Solution(z, r, J, cost, known.iterations, known.converged)
        then = problem.residuals(z + step)
        if then is None or not (after := _cost(problem, z + step, then)) <= cost + RISEN:
            return None
        z, r, cost = z + step, then, after
    return None


def _cost(problem: Problem, z: Array, residuals: Array) -> float:
    """Loss and prior."""
    return loss_of(residuals, problem.counts) + 0.5 * float(z @ z)


def posterior(jacobian: Array, residuals: Array, counts: Array) -> Array:
    """Covariance of z about a minimum, shape [n, n].

    It is A^-1 with A = J^T D J + E, D the curvature of the loss. Where a model misses something that its parameters
    move, residuals are large where J is: a standard deviation is at least that of A^-1 B A^-1 with B = J^T P J + E, P
    the square of the slope of the loss.

    Args:
        jacobian, residuals: There.
        counts: How many successive residuals count as one, shape [N].

    Source: Huber, Robust Statistics, 1981, section 7.6.
    """
    size = np.abs(residuals)
    prior = np.eye(jacobian.shape[1])
    A = jacobian.T @ (((size <= HUBER) / counts)[:, None] * jacobian) + prior
    B = jacobian.T @ ((np.minimum(size, HUBER) ** 2 / counts)[:, None] * jacobian) + prior
    inverse = np.linalg.inv(A)
    wider = np.sqrt(np.maximum(np.diag(inverse @ B @ inverse) / np.diag(inverse), 1.0))
    return np.asarray(wider[:, None] * inverse * wider)
