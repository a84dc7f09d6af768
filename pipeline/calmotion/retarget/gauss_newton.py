"""Gauss-Newton with conjugate gradients, within bounds; every accepted step lowers the objective."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..shot.character import Array, BoolArray


class LeastSquares(Protocol):
    """A problem min G(x), G = 1/2 |r(x)|^2 + quadratic, that can be linearised where it was last evaluated."""

    def value(self, x: Array) -> float:
        """Objective at x; infinite where it cannot be evaluated."""

    def linearize(self) -> Array:
        """Gradient at the point last accepted by `value`; products refer to the same point."""

    def product(self, direction: Array) -> Array:
        """Gauss-Newton matrix times a direction."""

    def precondition(self, fixed: BoolArray) -> Callable[[Array], Array]:
        """An approximate inverse of the Gauss-Newton matrix, for the entries that are not fixed."""

    def gain_is_small(self, gain: float, value: float) -> bool:
        """Whether a predicted decrease of the objective is not worth another iteration."""


@dataclass(frozen=True)
class Iterate:
    """Objective, norm of the projected gradient, evaluations and products so far."""

    value: float
    gradient_norm: float
    evaluations: int
    products: int


@dataclass(frozen=True, eq=False)
class Solution:
    """The best point found, the iterations (first the start), counts, and why it stopped."""

    x: Array
    history: tuple[Iterate, ...]
    evaluations: int
    gradients: int
    products: int
    reason: str


def conjugate_gradients(
    product: Callable[[Array], Array], b: Array, inverse: Callable[[Array], Array], tolerance: float, limit: int
) -> tuple[Array, Array, int]:
    """Preconditioned conjugate gradients from zero.

    Returns:
        The solution, the product of the matrix with it, and the number of products.
    """
    x, Ax = np.zeros_like(b), np.zeros_like(b)
    r = b.copy()
    z = inverse(r)
    p, rz = z.copy(), float(r @ z)
    target = tolerance**2 * rz
    for used in range(limit):
        if rz <= target or rz <= 0.0:
            return x, Ax, used
        Ap = product(p)
        curvature = float(p @ Ap)
        if curvature <= 0.0:
            return x, Ax, used + 1
        a = rz / curvature
        x += a * p
        Ax += a * Ap
        r -= a * Ap
        z = inverse(r)
        new = float(r @ z)
        p = z + (new / rz) * p
        rz = new
    return x, Ax, limit


def minimize(
    problem: LeastSquares,
    x: Array,
    bounds: Array,
    max_iterations: int = 30,
    max_products: int = 60,
    on_iterate: Callable[[Iterate, Array], None] | None = None,
) -> Solution:
    """Minimise within bounds by projected Gauss-Newton steps.

    Args:
        x: Start, shape [n]; moved into the bounds first.
        bounds: Lower and upper bound of each unknown, shape [n, 2].
        max_products: Most conjugate-gradient products of one iteration.
        on_iterate: Called with each iterate and the best point so far.
    """
    lower, upper = bounds[:, 0], bounds[:, 1]
    x = np.clip(x, lower, upper)
    value = problem.value(x)
    evaluations, gradients, products = 1, 0, 0
    history: list[Iterate] = []
    reason = "iteration limit"
    for _ in range(max_iterations):
        gradient = problem.linearize()
        gradients += 1
        fixed = ((x <= lower) & (gradient > 0.0)) | ((x >= upper) & (gradient < 0.0)) | (lower >= upper)
        free_gradient = np.where(fixed, 0.0, gradient)
        norm = float(np.linalg.norm(free_gradient))
        iterate = Iterate(value, norm, evaluations, products)
        history.append(iterate)
        if on_iterate is not None:
            on_iterate(iterate, x)
        if norm == 0.0:
            reason = "stationary"
            break

        def masked(d: Array, fixed: BoolArray = fixed) -> Array:
            return np.where(fixed, 0.0, problem.product(np.where(fixed, 0.0, d)))

        # the first systems need only a direction; later ones are solved as the model becomes exact
        accuracy = 0.1 if gradients == 1 else 0.01
        step, curved, used = conjugate_gradients(
            masked, -free_gradient, problem.precondition(fixed), accuracy, max_products
        )
        products += used
        gain = -float(gradient @ step + 0.5 * step @ curved)
        if problem.gain_is_small(gain, value):
            reason = "converged"
            break
        length, accepted = 1.0, False
        for _ in range(8):
            trial = np.clip(x + length * step, lower, upper)
            moved = trial - x
            expected = -float(gradient @ moved)
            trial_value = problem.value(trial)
            evaluations += 1
            if trial_value < value - 1e-4 * max(expected, 0.0) and expected > 0.0:
                accepted = True
                break
            length *= 0.5 if length == 1.0 else 0.25
        if not accepted:
            problem.value(x)
            evaluations += 1
            reason = "no further decrease"
            break
        small = problem.gain_is_small(value - trial_value, trial_value)
        x, value = trial, trial_value
        if small:
            history.append(Iterate(value, norm, evaluations, products))
            if on_iterate is not None:
                on_iterate(history[-1], x)
            reason = "converged"
            break
    return Solution(x, tuple(history), evaluations, gradients, products, reason)
