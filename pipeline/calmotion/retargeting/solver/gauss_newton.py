"""Gauss-Newton in a trust region, matrix-free; every accepted step lowers the merit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model.result import GOAL_REACHED
from calmotion.retargeting.solver.limited_step import LimitedStep, LinearLimited, limited_step
from calmotion.retargeting.solver.preconditioner import Sharpened
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.retargeting.solver.truncated_cg import Path, conjugate_gradients

RECYCLED_PAIRS = 24  # directions that are kept for the next system
STEP_REDUCTIONS = 10  # most reductions of a step in one iteration
FORCING_TERM = 0.01  # share of the decrease of an iteration at which conjugate gradients end
UNPREDICTED_SHARE = 0.1  # of the gain that ends a search: systems may leave as much, which is not predicted then
TRUSTED = 0.8, 1.25  # shares of the predicted decrease with which derivatives of another point are kept
ACCEPTED_RATIO = 0.05  # smallest share of the predicted decrease for a step to be accepted
SHORTER = 0.3  # factor of a step under limits that is not accepted; the next one begins as much longer
STALLED = 3  # steps under limits in a row that promise the gain that matters and bring less: the model is of no use


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

    def by_responses(self, known: Any = None) -> Any:
        """The same with derivatives that are a matrix, in its `sweeps`, which may be that `known` of a point nearby:
        hundreds of products cost no more than one here. None where there is none."""


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

    def gain(self, decrease: float) -> float:
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

    def tried(self, x: Array, near: Any = None) -> Any:
        """As `at`; None where the point cannot be evaluated or has no derivatives."""


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
        responses: Derivatives as a matrix, of steps under limits; None where there were none.
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
    responses: Any = None

    @classmethod
    def start(cls, x: Array, at: Any = None) -> Search:
        """A search that has not begun."""
        return cls(x, np.inf, Recycled.none(len(x)), at=at)


@dataclass(frozen=True)
class Ends:
    """When a search ends.

    Attributes:
        gain: A smaller predicted gain ends it [m].
        iterations: Most iterations, including those of the state that it resumes from.
        products: Most products of one iteration.
        reached: Whether a point is good enough.
    """

    gain: float
    iterations: int = 30
    products: int = 60
    reached: Callable[[Any], bool] = lambda at: False


OntoLimits = Callable[[Any], tuple[Any, Array]]


def minimize(
    problem: LeastSquares, search: Search, fixed: BoolArray, ends: Ends,
    on_iterate: Callable[[Search], None] | None = None, onto_limits: OntoLimits | None = None,
) -> Search:  # fmt: skip
    """Minimise over the entries that are not fixed.

    Args:
        search: State to begin or to resume from, whose point can be evaluated.
        fixed: Entries that keep their values, shape [n].
        ends: When it ends.
        on_iterate: Called with the search after every iteration.
        onto_limits: The problem and the point with which to go on where limits begin to act, from the minimum without
            them.

    Raises:
        SimulationFailure: The first point cannot be evaluated.
    """
    run = _GaussNewton(problem, search, fixed, ends, onto_limits)
    while not (reason := run.iterate()):
        if on_iterate is not None:
            on_iterate(run.state(reason))
    return run.state(reason)


class _GaussNewton:
    """A search that goes on by one iteration at a time; arguments as of `minimize`."""

    def __init__(
        self, problem: LeastSquares, search: Search, fixed: BoolArray, ends: Ends, onto_limits: OntoLimits | None
    ):
        self._fixed, self._ends, self._onto_limits = fixed, ends, onto_limits
        self._evaluations, self._gradients, self._products = search.evaluations + 1, search.gradients, search.products
        self._at = self._first = problem.at(search.x, search.at)
        self._radius, self._recycled, self._history = search.radius, search.recycled, list(search.history)
        self._sharpened, self._responses, self._share, self._stalled = search.sharpened, search.responses, 1.0, 0
        self._eager = self._sharpened is not None  # the first preconditioner has failed already
        if self._sharpened is not None and len(self._sharpened.point) != len(search.x):
            self._sharpened = None

    def state(self, reason: str) -> Search:
        """What the search has, from which another one may resume."""
        found = self._at.x, self._radius, self._recycled, self._sharpened, tuple(self._history)
        return Search(*found, self._evaluations, self._gradients, self._products, reason, self._at, self._responses)

    def iterate(self) -> str:
        """One step; why there is none, else nothing."""
        reached = self._ends.reached(self._at)
        if reached or len(self._history) >= self._ends.iterations:
            self._note(np.nan, np.nan)
            return GOAL_REACHED if reached else "iteration limit"
        linear: Linear = self._at.linearized()
        self._gradients += 1
        gradient = np.where(self._fixed, 0.0, linear.gradient)
        limited = self._at.limits_act
        predicted, take = self._under_limits(linear) if limited else self._in_trust_region(linear, gradient)
        expected = self._gain_of(predicted)
        self._note(float(np.linalg.norm(gradient)), expected)
        if expected >= self._ends.gain and take():
            return ""
        tightened = self._at.tightened()
        if tightened is None:
            return "converged" if expected < self._ends.gain else "no further decrease"
        if self._onto_limits is not None and not limited:
            tightened = self._moved(tightened, *self._onto_limits(tightened))
            # a minimum without limits may be farther from one within them than the point where the search began
            tightened = min(tightened, self._first.of(tightened.problem), key=lambda at: float(at.merit))
        self._at, self._radius, self._stalled = tightened, np.inf, 0
        return ""

    def _gain_of(self, decrease: float) -> float:
        return float(self._at.gain(decrease))

    @property
    def _enough(self) -> float:
        """Decrease of the merit that a linear system may leave."""
        return float(UNPREDICTED_SHARE * self._at.merit_of_gain(self._ends.gain))

    def _note(self, norm: float, gain: float) -> None:
        self._history.append(Iterate(self._at.merit, norm, gain, self._evaluations, self._products))

    def _evaluated(self, problem: LeastSquares, x: Array, near: Any) -> Any:
        """The evaluation of a point; None where it is of no use."""
        self._evaluations += 1
        return problem.tried(x, near)

    def _moved(self, at: Any, problem: LeastSquares, x: Array) -> Any:
        """Another point of another problem; the same point of that problem where the other cannot be evaluated."""
        found = None if np.array_equal(x, at.x) else self._evaluated(problem, x, at)
        return at.of(problem) if found is None else found

    def _under_limits(self, linear: Linear) -> tuple[float, Callable[[], bool]]:
        """The decrease that the model with limits predicts, and a function that takes its step, if it decreases."""
        ends = FORCING_TERM, self._enough, self._ends.products
        if (model := linear.by_responses(self._responses)) is not None:
            fresh, self._responses = model.sweeps is not self._responses, model.sweeps
            limited = limited_step(model, self._fixed, *ends, is_matrix=True)
        else:
            last = [0, *(iterate.products for iterate in self._history)][-2:]
            if (patience := linear.patience(self._sharpened)) is not None and last[-1] - last[0] > patience:
                self._sharpened = linear.sharpened()
            fresh, limited = True, limited_step(linear, self._fixed, *ends, self._sharpened)
            self._products += limited.products
        self._at = self._at.with_limits(limited.limits)
        return limited.predicted(1.0), partial(self._takes_limited, limited, fresh)

    def _takes_limited(self, limited: LimitedStep, fresh: bool) -> bool:
        """Step under limits, shortened until the simulation agrees with the model; whether steps bring enough. Where
        derivatives are not `fresh` but of another point, and predict a step badly, the next one has its own."""
        at, t = self._at, min(self._share / SHORTER, 1.0)
        for _ in range(STEP_REDUCTIONS if fresh else 1):
            there, predicted = self._evaluated(at.problem, at.x + t * limited.step, at), limited.predicted(t)
            ratio = -np.inf if there is None or not predicted > 0.0 else (at.merit - there.merit) / predicted
            if not TRUSTED[0] < ratio < TRUSTED[1]:
                self._responses = None
            if ratio > ACCEPTED_RATIO:
                brought = at.gain(at.merit - there.merit)
                self._stalled = 0 if brought >= self._ends.gain else self._stalled + 1
                self._at, self._radius, self._share = there, np.inf, t
                return self._stalled < STALLED
            t *= SHORTER
        return not fresh

    def _in_trust_region(self, linear: Linear, gradient: Array) -> tuple[float, Callable[[], bool]]:
        """The decrease that is predicted in the trust region, and a function that takes the step, if it is worth it.

        Where this would end the search, there is no region. One shrinks where the model is poor, and what little is to
        be gained within it says nothing of a minimum.
        """
        before = self._radius
        for self._radius in (before, np.inf):
            path = self._path(linear, gradient)
            self._recycled = self._recycled.followed_by(path.p, path.Hp, RECYCLED_PAIRS)
            _, predicted, length = path.within(self._radius)
            if self._gain_of(predicted) >= self._ends.gain or length < self._radius:
                break
        return predicted, partial(self._takes, path, self._radius > before)

    def _path(self, linear: Linear, gradient: Array) -> Path:
        """Conjugate gradients; if they take long, again with a better preconditioner."""

        def product(d: Array) -> Array:
            self._products += 1
            return np.where(self._fixed, 0.0, linear.product(d))

        most, patience = self._ends.products, linear.patience(self._sharpened)
        if self._eager and patience is not None and self._sharpened is None:
            self._sharpened, patience = linear.sharpened(), None
        for limit in (most if patience is None else min(patience, most), most):
            inverse = self._recycled.inverse(linear.precondition(self._fixed, self._sharpened))
            path = conjugate_gradients(product, gradient, inverse, self._radius, FORCING_TERM, self._enough, limit)
            if len(path.p) < limit or limit == most:
                break
            self._sharpened = linear.sharpened()
        return path

    def _takes(self, path: Path, widened: bool) -> bool:
        """Step along a path; whether that was worth it where the trust region was given up for it."""
        better = _step(self._evaluated, self._at, path, self._radius)
        if better is None:
            return False
        gained = self._gain_of(self._at.merit - better[0].merit)
        self._at, self._radius = better
        return not (widened and gained < self._ends.gain)


def _step(
    evaluated: Callable[[LeastSquares, Array, Any], Any], at: Any, path: Path, radius: float
) -> tuple[Any, float] | None:
    """The point after a step in the trust region, and the next radius; None if no step is accepted."""
    size = radius
    for _ in range(STEP_REDUCTIONS):
        step, predicted, length = path.within(size)
        if not predicted > 0.0:
            return None
        there = evaluated(at.problem, at.x + step, at)
        share = -np.inf if there is None else (at.merit - there.merit) / predicted
        if share > ACCEPTED_RATIO:
            if share < 0.25:
                return there, 0.5 * length
            grown = length >= 0.99 * size and share > 0.7
            return there, 2.5 * length if grown else max(size, 2.0 * length)
        size = (0.1 if there is None else 0.25) * length
    return None
