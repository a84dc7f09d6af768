"""Gauss-Newton in a trust region, matrix-free; every accepted step lowers the merit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model.result import GOAL_REACHED
from calmotion.multibody.failure import SimulationFailure
from calmotion.retargeting.solver.limited_step import LimitedStep, LinearLimited, limited_step
from calmotion.retargeting.solver.preconditioner import Sharpened
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.retargeting.solver.truncated_cg import Path, conjugate_gradients

RECYCLED_PAIRS = 24  # directions that are kept for the next system
STEP_REDUCTIONS = 10  # most reductions of a step in one iteration
FORCING_TERM = 0.01  # share of the decrease of an iteration at which conjugate gradients end
UNPREDICTED_SHARE = 0.1  # of the gain that ends a search: systems may leave as much, which is not predicted then
ACCEPTED_RATIO = 0.05  # smallest share of the predicted decrease for a step to be accepted


class Linear(LinearLimited, Protocol):
    """A least-squares problem min G(x), G = 1/2 |r(x)|^2 + quadratic, linearised at a point."""

    @property
    def gradient(self) -> Array:
        """Gradient of the merit, shape [n]."""

    def product(self, direction: Array) -> Array:
        """Gauss-Newton matrix times a direction."""

    def patience(self, sharpened: Sharpened | None) -> int | None:
        """Number of products of one system from which `sharpened` pays; None where it is of no use here."""

    def sharpened(self) -> Sharpened:
        """A better preconditioner, from what is known here."""


class Evaluated(Protocol):
    """What was computed at a point; nothing of it changes."""

    @property
    def problem(self) -> Any:
        """The problem, a `LeastSquares`."""

    @property
    def x(self) -> Array:
        """The point, shape [n]."""

    @property
    def merit(self) -> float:
        """G and the terms of limits that act."""

    @property
    def limits_act(self) -> bool:
        """Whether limits are part of the merit, so that `limited_step` finds the step."""

    def linearized(self) -> Any:
        """The derivatives, a `Linear`."""

    def with_limits(self, limits: Any) -> Any:
        """The same point where other limits are part of the merit."""

    def tightened(self) -> Any:
        """At a minimum: the same point of a merit that changed because limits are violated; None if it does not."""

    def gain(self, decrease: float, value: float) -> float:
        """Decrease of the root-mean-square error that corresponds to a decrease of the merit [m]."""

    def merit_of_gain(self, gain: float) -> float:
        """Decrease of the merit that corresponds to a gain [m]."""


class LeastSquares(Protocol):
    """What can be evaluated."""

    def at(self, x: Array, near: Any = None) -> Any:
        """The `Evaluated` at a point; from what is known at another one, where that helps.

        Raises:
            SimulationFailure: It cannot be evaluated.
        """


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
        sharpened: Preconditioner that was made on the way; None for the first one. Its point is of another size where
            the unknowns have changed since.
        history: Iterates so far, first the start.
        evaluations, gradients, products: Counts.
        reason: Why it ended; empty while it runs.
        at: What is known at the point, or at another one of the same robots.
    """

    x: Array
    radius: float
    recycled: Recycled
    sharpened: Sharpened | None = None
    history: tuple[Iterate, ...] = ()
    evaluations: int = 0
    gradients: int = 0
    products: int = 0
    reason: str = ""
    at: Any = None

    @classmethod
    def start(cls, x: Array, at: Any = None) -> Search:
        """A search that has not begun."""
        return cls(x, np.inf, Recycled.none(len(x)), at=at)


@dataclass
class _Counter:
    """Calls of a problem."""

    fixed: BoolArray
    evaluations: int = 0
    gradients: int = 0
    products: int = 0

    def at(self, problem: LeastSquares, x: Array, near: Any) -> Any:
        """The evaluation of a point; None where it cannot be evaluated."""
        self.evaluations += 1
        try:
            return problem.at(x, near)
        except SimulationFailure:
            return None

    def gradient(self, linear: Linear) -> Array:
        self.gradients += 1
        return np.where(self.fixed, 0.0, linear.gradient)

    def product(self, linear: Linear) -> Callable[[Array], Array]:
        def times(d: Array) -> Array:
            self.products += 1
            return np.where(self.fixed, 0.0, linear.product(d))

        return times


def minimize(
    problem: LeastSquares,
    search: Search,
    fixed: BoolArray,
    gain: float,
    max_iterations: int = 30,
    max_products: int = 60,
    on_iterate: Callable[[Search], None] | None = None,
    onto_limits: Callable[[Any], tuple[Any, Array]] | None = None,
    reached: Callable[[Any], bool] = lambda at: False,
) -> Search:
    """Minimise over the entries that are not fixed.

    Args:
        search: State to begin or to resume from, whose point can be evaluated.
        fixed: Entries that keep their values, shape [n].
        gain: A smaller predicted gain ends the search [m].
        max_iterations: Most iterations, including those of the state.
        max_products: Most products of one iteration.
        on_iterate: Called with the search after every iteration.
        onto_limits: The problem and the point with which to go on where limits begin to act, from the minimum without
            them.
        reached: Whether a point is good enough, so that the search ends there.

    Raises:
        SimulationFailure: The first point cannot be evaluated.
    """
    calls = _Counter(fixed, search.evaluations, search.gradients, search.products)
    radius, recycled, history, sharpened = search.radius, search.recycled, list(search.history), search.sharpened
    eager = sharpened is not None
    calls.evaluations += 1
    at = problem.at(search.x, search.at)
    if sharpened is not None and len(sharpened.point) != len(search.x):
        sharpened = None

    def here(reason: str = "") -> Search:
        counts = calls.evaluations, calls.gradients, calls.products
        return Search(at.x, radius, recycled, sharpened, tuple(history), *counts, reason, at)

    while True:
        widened = False
        ended = GOAL_REACHED if reached(at) else "iteration limit" if len(history) >= max_iterations else ""
        if ended:
            history.append(Iterate(at.merit, np.nan, np.nan, calls.evaluations, calls.products))
            return here(ended)
        linear = at.linearized()
        gradient = calls.gradient(linear)
        norm = float(np.linalg.norm(gradient))
        enough = UNPREDICTED_SHARE * at.merit_of_gain(gain)
        if at.limits_act:
            if (patience := linear.patience(sharpened)) is not None and _last_products(history) > patience:
                sharpened = linear.sharpened()
            limited = limited_step(linear, fixed, FORCING_TERM, enough, max_products, sharpened)
            calls.products += limited.products
            at, predicted = at.with_limits(limited.limits), limited.predicted(1.0)
        else:
            before = radius
            least = partial(at.gain, value=at.merit), gain
            path, (recycled, sharpened), radius = _solved(
                linear, calls, gradient, (recycled, sharpened), radius, enough, max_products, eager, least
            )  # fmt: skip
            predicted, widened = path.within(radius)[1], radius > before
        expected = at.gain(predicted, at.merit)
        history.append(Iterate(at.merit, norm, expected, calls.evaluations, calls.products))
        better = None
        if expected >= gain:
            better = _limited_step(calls, at, limited) if at.limits_act else _step(calls, at, path, radius)
        if better is not None and widened and at.gain(at.merit - better[0].merit, at.merit) < gain:
            (at, radius), better = better, None
        if better is None:
            tightened = at.tightened()
            if tightened is None:
                return here("converged" if expected < gain else "no further decrease")
            if onto_limits is not None and not at.limits_act:
                tightened = _moved(calls, tightened, *onto_limits(tightened))
            better = tightened, np.inf
        at, radius = better
        if on_iterate is not None:
            on_iterate(here())


def _moved(calls: _Counter, at: Any, problem: LeastSquares, x: Array) -> Any:
    """Another point of another problem; the same point of that problem where the other cannot be evaluated."""
    found = None if np.array_equal(x, at.x) else calls.at(problem, x, at)
    return at.of(problem) if found is None else found


def _last_products(history: list[Iterate]) -> int:
    """Products of the last linear system."""
    counts = [0, *(iterate.products for iterate in history)]
    return counts[-1] - counts[-2] if history else 0


def _solved(
    linear: Linear, calls: _Counter, gradient: Array, known: tuple[Recycled, Sharpened | None], radius: float,
    enough: float, max_products: int, eager: bool, least: tuple[Callable[[float], float], float],
) -> tuple[Path, tuple[Recycled, Sharpened | None], float]:  # fmt: skip
    """As `_path`, with what is known after it and the trust region; without a region where this would end the search.

    A region shrinks where the model is poor, and what little is to be gained within it says nothing of a minimum.

    Args:
        least: The gain that a decrease of the merit is, and the one that ends a search [m].
    """
    gain_of, gain = least
    for size in (radius, np.inf):
        path, sharpened = _path(linear, calls, gradient, known, size, enough, max_products, eager)
        known = known[0].followed_by(path.p, path.Hp, RECYCLED_PAIRS), sharpened
        _, predicted, length = path.within(size)
        if gain_of(predicted) >= gain or length < size:
            break
    return path, known, size


def _path(
    linear: Linear, calls: _Counter, gradient: Array, known: tuple[Recycled, Sharpened | None], radius: float,
    enough: float, max_products: int, eager: bool,
) -> tuple[Path, Sharpened | None]:  # fmt: skip
    """Conjugate gradients; if they take long, again with a better preconditioner, which is the second value.

    Args:
        known: Directions of earlier systems, and the preconditioner so far.
        eager: Whether the first preconditioner has failed already.
    """
    recycled, sharpened = known
    patience = linear.patience(sharpened)
    if eager and patience is not None and sharpened is None:
        sharpened, patience = linear.sharpened(), None
    for limit in (max_products if patience is None else min(patience, max_products), max_products):
        inverse = recycled.inverse(linear.precondition(calls.fixed, sharpened))
        path = conjugate_gradients(calls.product(linear), gradient, inverse, radius, FORCING_TERM, enough, limit)
        if len(path.p) < limit or limit == max_products:
            break
        sharpened = linear.sharpened()
    return path, sharpened


def _limited_step(calls: _Counter, at: Any, limited: LimitedStep) -> tuple[Any, float] | None:
    """The point after a step under limits, which is shortened until the simulation agrees with the model."""
    t = 1.0
    for _ in range(STEP_REDUCTIONS):
        there, predicted = calls.at(at.problem, at.x + t * limited.step, at), limited.predicted(t)
        if there is not None and predicted > 0.0 and at.merit - there.merit > ACCEPTED_RATIO * predicted:
            return there, np.inf
        t *= 0.3
    return None


def _step(calls: _Counter, at: Any, path: Path, radius: float) -> tuple[Any, float] | None:
    """The point after a step in the trust region, and the next radius; None if no step is accepted."""
    size = radius
    for _ in range(STEP_REDUCTIONS):
        step, predicted, length = path.within(size)
        if not predicted > 0.0:
            return None
        there = calls.at(at.problem, at.x + step, at)
        share = -np.inf if there is None else (at.merit - there.merit) / predicted
        if share > ACCEPTED_RATIO:
            if share < 0.25:
                return there, 0.5 * length
            grown = length >= 0.99 * size and share > 0.7
            return there, 2.5 * length if grown else max(size, 2.0 * length)
        size = (0.1 if there is None else 0.25) * length
    return None
