"""Gauss-Newton in a trust region, matrix-free; every accepted step lowers the merit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from calmotion.retargeting.solver.limited_step import LimitedStep
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.retargeting.solver.truncated_cg import Path, conjugate_gradients
from calmotion.shot.character import Array, BoolArray

PAIRS = 24  # directions that are kept for the next system
TRIES = 10  # smaller and smaller steps before an iteration gives up
SHARE = 0.01  # of an iteration's decrease, that it may leave to the next one
ACCEPTED = 0.05  # least share of the predicted decrease that a step must bring


class LeastSquares(Protocol):
    """A problem min G(x), G = 1/2 |r(x)|^2 + quadratic, that can be linearised where it was last evaluated."""

    def value(self, x: Array) -> float:
        """Merit at x; infinite where it cannot be evaluated."""

    def linearize(self) -> Array:
        """Gradient at the point last evaluated; products refer to the same point."""

    def product(self, direction: Array) -> Array:
        """Gauss-Newton matrix times a direction."""

    def precondition(self, fixed: BoolArray) -> Callable[[Array], Array]:
        """An approximate inverse of the Gauss-Newton matrix, for the entries that are not fixed."""

    @property
    def limits_act(self) -> bool:
        """Whether limits are part of the merit now, so that `limited_step` finds the step."""

    def limited_step(self, fixed: BoolArray, share: float, enough: float, max_products: int) -> LimitedStep:
        """The step to the minimum of the model with limits; may change the merit."""

    def merit(self) -> float:
        """The merit at the point evaluated last, as it is now."""

    def gain(self, decrease: float, value: float) -> float:
        """What a decrease of the merit is worth, in a measure that the user knows [m]."""

    def worth(self, gain: float) -> float:
        """The decrease of the merit that is worth so much, at the point evaluated last."""

    def tighten(self) -> bool:
        """Called at a minimum: whether the merit was changed, so that the search goes on (limits not yet kept)."""


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
    """Where a search stands between two iterations; it goes on from here as if it had not stopped.

    Attributes:
        x: The best point, shape [n].
        radius: Of the trust region.
        recycled: What earlier systems taught.
        history: Iterates so far, first the start.
        evaluations, gradients, products: Counts.
        reason: Why it ended; empty while it has not.
    """

    x: Array
    radius: float
    recycled: Recycled
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
) -> Search:
    """Minimise over the entries that are not fixed.

    Args:
        search: Where to begin or to go on.
        fixed: Entries that keep their values, shape [n].
        gain: A predicted gain of less ends the search [m].
        max_iterations: Most iterations, those of earlier parts of the search included.
        max_products: Most products of one iteration.
        on_iterate: Called with the search after every iteration.
    """
    calls = _Counter(problem, search.evaluations, search.gradients, search.products, fixed)
    x, radius, recycled, history = search.x, search.radius, search.recycled, list(search.history)
    value = calls.value(x)

    def here(reason: str = "") -> Search:
        return Search(
            x, radius, recycled, tuple(history), calls.evaluations, calls.gradients, calls.products, reason
        )  # fmt: skip

    while True:
        if len(history) >= max_iterations:
            history.append(Iterate(value, np.nan, np.nan, calls.evaluations, calls.products))
            return here("iteration limit")
        gradient = calls.gradient()
        norm = float(np.linalg.norm(gradient))
        enough = problem.worth(gain)
        if problem.limits_act:
            limited = problem.limited_step(fixed, SHARE, enough, max_products)
            calls.products += limited.products
            value, predicted = problem.merit(), limited.predicted(1.0)
        else:
            inverse = recycled.inverse(problem.precondition(fixed))
            path = conjugate_gradients(calls.product, gradient, inverse, radius, SHARE, enough, max_products)
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
                calls.value(x)  # steps that failed were evaluated last
            if problem.tighten():
                value, radius = problem.merit(), np.inf
                if on_iterate is not None:
                    on_iterate(here())
                continue
            return here("converged" if expected < gain else "no further decrease")
        x, value, radius = better
        if on_iterate is not None:
            on_iterate(here())


def _limited_step(calls: _Counter, x: Array, value: float, limited: LimitedStep) -> tuple[Array, float, float] | None:
    """The same where limits act: as much of the step as the simulation agrees with."""
    t = 1.0
    for _ in range(TRIES):
        found, predicted = calls.value(x + t * limited.step), limited.predicted(t)
        if predicted > 0.0 and value - found > ACCEPTED * predicted:
            return x + t * limited.step, found, np.inf
        t *= 0.3
    return None


def _step(calls: _Counter, x: Array, value: float, path: Path, radius: float) -> tuple[Array, float, float] | None:
    """The point that a step within the region leads to, its merit, and the next region; None where none is better."""
    size = radius
    for _ in range(TRIES):
        step, predicted, length = path.within(size)
        if not predicted > 0.0:
            return None
        found = calls.value(x + step)
        share = (value - found) / predicted
        if share > ACCEPTED:
            if share < 0.25:
                return x + step, found, 0.5 * length
            grown = length >= 0.99 * size and share > 0.7
            return x + step, found, 2.5 * length if grown else max(size, 2.0 * length)
        size = (0.1 if not np.isfinite(found) else 0.25) * length
    return None
