"""A Gauss-Newton step under limits: the convex model of objective and limits, minimised without simulating.

With residuals r + J s and limited quantities v + A s linear in the step s, the model is piecewise quadratic. Semismooth
Newton finds its minimum: conjugate gradients for the limits that act, an exact search along their solution, and again
with those that act there. Multipliers are updated inside the model, so that its minimum keeps the limits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from calmotion.retargeting.solver.truncated_cg import conjugate_gradients
from calmotion.shot.character import Array, BoolArray

Values = dict[str, Array]

INNER = 20  # solutions with other limits acting, at most
MOST = 8  # times the products of one solution, for all of them
FAR = 4.0  # the farthest that a search goes along one solution


@dataclass(eq=False)
class ModelPoint:
    """A point of the model: the step, what it does to residuals and limited quantities."""

    step: Array
    residuals: Array
    values: Values

    def moved(self, by: ModelPoint, t: float) -> ModelPoint:
        """This point plus t times another."""
        values = {name: v + t * by.values[name] for name, v in self.values.items()}
        return ModelPoint(self.step + t * by.step, self.residuals + t * by.residuals, values)


class Limits(Protocol):
    """What the step needs of the limits of a problem."""

    def update(self, values: Values) -> bool:
        """Update the multipliers after a minimum of the model; False where all limits are kept."""

    def curvature(self, name: str, v: Array) -> Array:
        """Second derivative of the limits' cost by a limited quantity, of its shape."""


class LimitedProblem(Protocol):
    """What the step needs of a problem that is linearised."""

    @property
    def size(self) -> int: ...
    @property
    def residuals(self) -> Array: ...
    @property
    def limited(self) -> Values: ...
    @property
    def limits(self) -> Limits | None: ...
    def jvp(self, direction: Array) -> tuple[Array, Values]: ...
    def vjp(self, residuals: Array, limited: Values) -> Array: ...
    def penalty_gradient(self, x: Array) -> Array: ...
    def precondition(self, fixed: BoolArray, values: Values) -> Callable[[Array], Array]: ...
    def model_value(self, point: ModelPoint) -> float: ...
    def model_objective(self, point: ModelPoint) -> float: ...
    def model_gradient(self, point: ModelPoint) -> Array: ...
    def model_slope(self, point: ModelPoint, way: ModelPoint) -> float: ...


@dataclass(eq=False)
class LimitedStep:
    """The step to the model's minimum.

    Attributes:
        step: Shape [n].
        products: How many it took.
        predicted: Decrease of the merit that the model predicts for a share of the step.
        eased: Decrease of the objective alone, without what limits add to it.
    """

    step: Array
    products: int
    predicted: Callable[[float], float]
    eased: float


def limited_step(
    problem: LimitedProblem, fixed: BoolArray, share: float, enough: float, max_products: int
) -> LimitedStep:
    """The minimum of the model at the point that was linearised.

    Args:
        problem: With limits that act; their multipliers are updated.
        fixed: Unknowns that keep their values, shape [n].
        share, enough: As `truncated_cg.conjugate_gradients` takes them.
        max_products: Most products of one solution.
    """
    limits = problem.limits
    assert limits is not None
    start = ModelPoint(np.zeros(problem.size), problem.residuals, dict(problem.limited))
    here, gained, products = start, 0.0, 0
    for _ in range(INNER):
        gradient = np.where(fixed, 0.0, problem.model_gradient(here))
        way, used = _newton_direction(problem, here, gradient, fixed, share, enough, max_products)
        products += used
        t = _search(problem, here, way)
        before = problem.model_value(here)
        here = here.moved(way, t)
        decrease = before - problem.model_value(here)
        gained += decrease
        if products > MOST * max_products:
            break
        if decrease <= max(enough, share * gained) and not limits.update(here.values):
            break

    def predicted(t: float) -> float:
        there = ModelPoint(
            t * here.step,
            start.residuals + t * (here.residuals - start.residuals),
            {name: v + t * (here.values[name] - v) for name, v in start.values.items()},
        )
        return problem.model_value(start) - problem.model_value(there)

    eased = problem.model_objective(start) - problem.model_objective(here)
    return LimitedStep(here.step, products, predicted, eased)


def _newton_direction(
    problem: LimitedProblem, here: ModelPoint, gradient: Array, fixed: BoolArray, share: float, enough: float,
    max_products: int,
) -> tuple[ModelPoint, int]:  # fmt: skip
    """To the minimum of the model in which the limits that act here are all that do, and the products it took."""
    limits = problem.limits
    assert limits is not None
    weights = {name: limits.curvature(name, v) for name, v in here.values.items()}
    carried: list[tuple[Array, Values]] = []

    def product(d: Array) -> Array:
        residuals, values = problem.jvp(d)
        carried.append((residuals, values))
        weighted = {name: weights[name] * v for name, v in values.items()}
        return np.where(fixed, 0.0, problem.vjp(residuals, weighted) + problem.penalty_gradient(d))

    inverse = problem.precondition(fixed, here.values)
    path = conjugate_gradients(product, gradient, inverse, np.inf, share, enough, max_products)
    way = ModelPoint(
        path.steps[-1], np.zeros_like(here.residuals), {name: np.zeros_like(v) for name, v in here.values.items()}
    )
    for k, (residuals, values) in enumerate(carried[: len(path.p)]):
        along = path.p[k]
        a = float(along @ (path.steps[k + 1] - path.steps[k])) / float(along @ along)
        way.residuals += a * residuals
        for name, v in values.items():
            way.values[name] += a * v
    return way, len(carried)


def _search(problem: LimitedProblem, here: ModelPoint, way: ModelPoint) -> float:
    """Where the model is least along a direction: its slope grows, so bisection finds where it vanishes."""

    def slope(t: float) -> float:
        return problem.model_slope(here.moved(way, t), way)

    low, high = 0.0, 1.0
    while slope(high) < 0.0 and high < FAR:
        low, high = high, 2.0 * high
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if slope(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)
