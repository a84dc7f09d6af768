"""Gauss-Newton in a trust region, matrix-free; every accepted step lowers the merit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.retargeting.solver.limited_step import LimitedProblem, LimitedStep, limited_step
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.retargeting.solver.truncated_cg import Path, conjugate_gradients

PAIRS = 24  # directions that are kept for the next system
TRIES = 10  # most reductions of a step in one iteration
SHARE = 0.01  # share of the decrease of an iteration at which conjugate gradients end
ACCEPTED = 0.05  # smallest share of the predicted decrease for a step to be accepted


class LeastSquares(LimitedProblem, Protocol):
    """A problem min G(x), G = 1/2 |r(x)|^2 + quadratic, that can be linearised where it was last evaluated."""

    def value(self, x: Array) -> float:
        """Merit at x; infinite where it cannot be evaluated."""

    def linearize(self) -> Array:
        """Gradient at the point last evaluated; products refer to the same point."""

    def product(self, direction: Array) -> Array:
        """Gauss-Newton matrix times a direction."""

    @property
    def limits_act(self) -> bool:
        """Whether limits are part of the merit now, so that `limited_step` finds the step."""

    def merit(self) -> float:
        """The merit at the point evaluated last, as it is now."""

    @property
    def patience(self) -> int | None:
        """Number of products of one system from which `sharpen` pays; None where it is of no use here."""

    def sharpen(self) -> None:
        """Make the preconditioner better, where the problem is linearised."""

    @property
    def sharpened_at(self) -> Array:
        """The point at which `sharpen` was called last; empty if it was not."""

    def gain(self, decrease: float, value: float) -> float:
        """Decrease of the root-mean-square error that corresponds to a decrease of the merit [m]."""

    def merit_of_gain(self, gain: float) -> float:
        """Decrease of the merit that corresponds to a gain [m], at the point evaluated last."""

    def tighten(self) -> bool:
        """Called at a minimum: whether the merit changed because limits are violated, so that the search continues."""


@dataclass(frozen=True)
class Iterate:
    """Merit, norm of the gradient, the gain that was predicted from there [m], evaluations and products so far.

    Norm and gain are NaN where the search ended before they were worked out.
    """

    value: float
    gradient_norm: float
    gain: float
    evaluations: int
    products: int


@dataclass(frozen=True, eq=False)
class Search:
    """State of a search between two iterations; a search that resumes from it gives the same result.

    Attributes:
        x: The best point, shape [n].
        radius: Of the trust region.
        recycled: Search directions of earlier linear systems.
        history: Iterates so far, first the start.
        sharpened: Point of the problem's preconditioner (`LeastSquares.sharpen`), shape [n]; empty for the first one,
            and of another size where the unknowns have changed since.
        evaluations, gradients, products: Counts.
        reason: Why it ended; empty while it runs.
    """

    x: Array
    radius: float
    recycled: Recycled
    sharpened: Array = field(default_factory=lambda: np.zeros(0))
    history: tuple[Iterate, ...] = ()
    evaluations: int = 0
    gradients: int = 0
    products: int = 0
    reason: str = ""

    @classmethod
    def start(cls, x: Array) -> Search:
        """A search that has not begun."""
        return cls(x, np.inf, Recycled.none(len(x)))


@dataclass
class _Counter:
    """Calls of a problem."""

    problem: LeastSquares
    evaluations: int = 0
    gradients: int = 0
    products: int = 0
    fixed: BoolArray = field(default_factory=lambda: np.zeros(0, bool))

    def value(self, x: Array) -> float:
        self.evaluations += 1
        return self.problem.value(x)

    def gradient(self) -> Array:
        self.gradients += 1
        return np.where(self.fixed, 0.0, self.problem.linearize())

    def product(self, d: Array) -> Array:
        self.products += 1
        return np.where(self.fixed, 0.0, self.problem.product(d))


def minimize(
    problem: LeastSquares,
    search: Search,
    fixed: BoolArray,
    gain: float,
    max_iterations: int = 30,
    max_products: int = 60,
    on_iterate: Callable[[Search], None] | None = None,
    onto_limits: Callable[[Array], Array] | None = None,
) -> Search:
    """Minimise over the entries that are not fixed.

    Args:
        search: State to begin or to resume from.
        fixed: Entries that keep their values, shape [n].
        gain: A smaller predicted gain ends the search [m].
        max_iterations: Most iterations, including those of the state.
        max_products: Most products of one iteration.
        on_iterate: Called with the search after every iteration.
        onto_limits: The point from which to go on where limits begin to act, from that of the minimum without them.
    """
    calls = _Counter(problem, search.evaluations, search.gradients, search.products, fixed)
    x, radius, recycled, history = search.x, search.radius, search.recycled, list(search.history)
    eager = len(search.sharpened) > 0
    if len(search.sharpened) == len(x) and not np.array_equal(search.sharpened, problem.sharpened_at):
        calls.value(search.sharpened)  # a resumed search
        calls.gradient()
        problem.sharpen()
    value = calls.value(x)

    def here(reason: str = "") -> Search:
        return Search(
            x, radius, recycled, problem.sharpened_at, tuple(history), calls.evaluations, calls.gradients,
            calls.products, reason,
        )  # fmt: skip

    while True:
        if len(history) >= max_iterations:
            history.append(Iterate(value, np.nan, np.nan, calls.evaluations, calls.products))
            return here("iteration limit")
        gradient = calls.gradient()
        norm = float(np.linalg.norm(gradient))
        enough = problem.merit_of_gain(gain)
        if problem.limits_act:
            if (patience := problem.patience) is not None and _last_products(history) > patience:
                problem.sharpen()
            limited = limited_step(problem, fixed, SHARE, enough, max_products)
            calls.products += limited.products
            value, predicted = problem.merit(), limited.predicted(1.0)
        else:
            path = _path(problem, calls, gradient, recycled, radius, enough, max_products, eager)
            recycled = recycled.followed_by(path.p, path.Hp, PAIRS)
            _, predicted, _ = path.within(radius)
        expected = problem.gain(predicted, value)
        history.append(Iterate(value, norm, expected, calls.evaluations, calls.products))
        better = None
        if expected >= gain:
            if problem.limits_act:
                better = _limited_step(calls, x, value, limited)
            else:
                better = _step(calls, x, value, path, radius)
        if better is None:
            if expected >= gain:
                calls.value(x)  # the point evaluated last is that of a rejected step
            acted = problem.limits_act
            if problem.tighten():
                if onto_limits is not None and not acted:
                    x = _if_finite(calls, x, onto_limits(x))
                value, radius = problem.merit(), np.inf
                if on_iterate is not None:
                    on_iterate(here())
                continue
            return here("converged" if expected < gain else "no further decrease")
        x, value, radius = better
        if on_iterate is not None:
            on_iterate(here())


def _if_finite(calls: _Counter, x: Array, other: Array) -> Array:
    """Another point, or the same one where the other cannot be evaluated; it is the point evaluated last."""
    if np.array_equal(other, x) or np.isfinite(calls.value(other)):
        return other
    calls.value(x)
    return x


def _last_products(history: list[Iterate]) -> int:
    """Products of the last linear system."""
    counts = [0, *(iterate.products for iterate in history)]
    return counts[-1] - counts[-2] if history else 0


def _path(
    problem: LeastSquares, calls: _Counter, gradient: Array, recycled: Recycled, radius: float, enough: float,
    max_products: int, eager: bool,
) -> Path:  # fmt: skip
    """Conjugate gradients; if they take long, again with a better preconditioner.

    Args:
        eager: Whether the first preconditioner has failed already.
    """
    patience = problem.patience
    if eager and patience is not None and not len(problem.sharpened_at):
        problem.sharpen()
        patience = None
    for limit in (max_products if patience is None else min(patience, max_products), max_products):
        inverse = recycled.inverse(problem.precondition(calls.fixed))
        path = conjugate_gradients(calls.product, gradient, inverse, radius, SHARE, enough, limit)
        if len(path.p) < limit or limit == max_products:
            break
        problem.sharpen()
    return path


def _limited_step(calls: _Counter, x: Array, value: float, limited: LimitedStep) -> tuple[Array, float, float] | None:
    """The same under limits: the step is shortened until the simulation agrees with the model."""
    t = 1.0
    for _ in range(TRIES):
        merit, predicted = calls.value(x + t * limited.step), limited.predicted(t)
        if predicted > 0.0 and value - merit > ACCEPTED * predicted:
            return x + t * limited.step, merit, np.inf
        t *= 0.3
    return None


def _step(calls: _Counter, x: Array, value: float, path: Path, radius: float) -> tuple[Array, float, float] | None:
    """The point after a step in the trust region, its merit and the next radius; None if no step is accepted."""
    size = radius
    for _ in range(TRIES):
        step, predicted, length = path.within(size)
        if not predicted > 0.0:
            return None
        merit = calls.value(x + step)
        share = (value - merit) / predicted
        if share > ACCEPTED:
            if share < 0.25:
                return x + step, merit, 0.5 * length
            grown = length >= 0.99 * size and share > 0.7
            return x + step, merit, 2.5 * length if grown else max(size, 2.0 * length)
        size = (0.1 if not np.isfinite(merit) else 0.25) * length
    return None
