"""A Gauss-Newton step under limits: the convex model of objective and limits, minimised without simulating.

With residuals r + J s and limited quantities v + A s linear in the step s, the model is piecewise quadratic (smooth and
convex in the residuals where these have another norm). Semismooth
Newton finds its minimum: conjugate gradients with the active limits fixed, an exact line search along the solution,
and again with the limits that are active there. Multipliers are updated inside the model, so that its minimum keeps
the limits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.retargeting.solver.norm import Norm
from calmotion.retargeting.solver.preconditioner import Sharpened
from calmotion.retargeting.solver.truncated_cg import conjugate_gradients

Values = dict[str, Array]

NEWTON_ITERATIONS = 20  # most Newton iterations
STALLED, PATIENCE = 0.8, 3  # limits cannot be kept where so many updates in a row each leave more than this share
OF_A_MATRIX = 200  # the same where derivatives are a matrix: limits come to act one after the other
PRODUCTS_OVER_ONE_SYSTEM = 8  # most products of all iterations, over those of one
LONGEST_STEP = 4.0  # longest step of a line search, over the Newton step


@dataclass(eq=False)
class ModelPoint:
    """A point of the model: step, residuals and limited quantities; or a direction, with their changes."""

    step: Array
    residuals: Array
    values: Values

    def moved(self, by: ModelPoint, t: float) -> ModelPoint:
        """This point plus t times another."""
        values = {name: v + t * by.values[name] for name, v in self.values.items()}
        return ModelPoint(self.step + t * by.step, self.residuals + t * by.residuals, values)


class Limits(Protocol):
    """Limits as terms of an augmented Lagrangian, evaluated at values of the limited quantities."""

    def value(self, values: Values) -> float:
        """The sum of the terms."""

    def gradient(self, name: str, v: Array) -> Array:
        """Derivative of the terms with respect to the values of one quantity, shape of v."""

    def curvature(self, name: str, v: Array) -> Array:
        """Second derivative of the terms where they act, shape of v."""

    def excess(self, values: Values) -> float:
        """Largest excess of a limit."""

    def updated(self, values: Values, objective: float, grows: bool = True) -> Self | None:
        """With new multipliers after a minimum, and a larger penalty if it may grow; None where all limits are kept."""


class Regulariser(Protocol):
    """A quadratic function of the unknowns."""

    def penalty_gradient(self, x: Array) -> Array:
        """Its gradient, shape [n]."""

    def penalty_product(self, x: Array) -> Array:
        """Its matrix times x, shape [n]."""

    def penalty_value(self, x: Array) -> float:
        """Its value."""


class LinearLimited(Protocol):
    """A least-squares problem with limits, linearised at a point x; n unknowns."""

    @property
    def x(self) -> Array:
        """The point, shape [n]."""

    @property
    def residuals(self) -> Array:
        """Weighted residuals there."""

    @property
    def norm(self) -> Norm:
        """What is minimised of the residuals."""

    @property
    def limited(self) -> Values:
        """Values of the limited quantities there."""

    @property
    def limits(self) -> Any:
        """The limits that act, `Limits`; None where there are none."""

    @property
    def regulariser(self) -> Regulariser:
        """Of the unknowns; it may hold steps back."""

    @property
    def pull(self) -> Array | float:
        """What the gradient has beside that of `jvp`, shape [n]."""

    def jvp(self, direction: Array) -> tuple[Array, Values]:
        """Change of the residuals and of the limited quantities along a direction of shape [n]."""

    def vjp(self, residuals: Array, limited: Values) -> Array:
        """The transpose of `jvp`, shape [n]."""

    def precondition(
        self, fixed: BoolArray, sharpened: Sharpened | None = None, limits: Any = None, values: Values | None = None
    ) -> Callable[[Array], Array]:
        """An approximate inverse of the Gauss-Newton matrix; limits and values of their quantities say which act."""


@dataclass(eq=False)
class LimitedStep:
    """The step to the model's minimum.

    Attributes:
        step: Shape [n].
        products: Number of products with the Gauss-Newton matrix.
        predicted: Decrease of the merit that the model predicts for a share of the step.
        eased: Decrease of the objective, without the terms of the limits.
        limits: With the multipliers of the minimum.
    """

    step: Array
    products: int
    predicted: Callable[[float], float]
    eased: float
    limits: Any


class LimitedModel:
    """Residuals and limited quantities linear in the step, squared and penalised: a convex, piecewise quadratic merit.

    Args:
        linear: The problem at a point.
        limits: With multipliers; None: those of the problem.
    """

    def __init__(self, linear: LinearLimited, limits: Limits | None = None):
        self.linear, self.limits = linear, limits or linear.limits
        self.start = ModelPoint(np.zeros(len(linear.x)), linear.residuals, dict(linear.limited))

    def objective(self, point: ModelPoint) -> float:
        """The objective, without the terms of the limits."""
        linear = self.linear
        errors = linear.norm.value(point.residuals) + float(np.sum(linear.pull * point.step))
        return errors + linear.regulariser.penalty_value(linear.x + point.step)

    def merit(self, point: ModelPoint) -> float:
        """The objective and the terms of the limits."""
        return self.objective(point) + self.limits.value(point.values)

    def acting(self, point: ModelPoint) -> list[bytes]:
        """Which limits act, as something that can be compared."""
        return [np.packbits(self.limits.curvature(name, v) > 0.0).tobytes() for name, v in point.values.items()]

    def gradient(self, point: ModelPoint) -> Array:
        """Gradient of the merit, shape [n]."""
        pulls = {name: self.limits.gradient(name, v) for name, v in point.values.items()}
        return self.linear.vjp(self.linear.norm.gradient(point.residuals), pulls) + self._besides(point)

    def slope(self, point: ModelPoint, direction: ModelPoint) -> float:
        """Slope of the merit along a direction."""
        errors = self.linear.norm.gradient(point.residuals)
        slope = float(np.sum(errors * direction.residuals)) + float(direction.step @ self._besides(point))
        return slope + sum(
            float(np.sum(self.limits.gradient(name, v) * direction.values[name])) for name, v in point.values.items()
        )

    def _besides(self, point: ModelPoint) -> Array:
        """The part of the gradient that is neither by residuals nor by limits, shape [n]."""
        return self.linear.regulariser.penalty_gradient(self.linear.x + point.step) + self.linear.pull


def limited_step(
    linear: LinearLimited, fixed: BoolArray, share: float, enough: float, max_products: int,
    sharpened: Sharpened | None = None, is_matrix: bool = False,
) -> LimitedStep:  # fmt: skip
    """The minimum of the model at the point that was linearised.

    Args:
        linear: With limits that act.
        fixed: Unknowns that keep their values, shape [n].
        share, enough: As `truncated_cg.conjugate_gradients` takes them.
        max_products: Most products of one solution.
        sharpened: Preconditioner; None for that of the problem.
        is_matrix: Whether derivatives are a matrix. Multipliers then wait until it is settled which limits act:
            updates before that made the penalty grow until steps were short. Otherwise it does not grow here: what the
            model leaves of an excess may be what its minimum was not solved to.
    """
    model = LimitedModel(linear)
    start = point = model.start
    gained, products, left, stalled = 0.0, 0, np.inf, 0
    for _ in range(OF_A_MATRIX if is_matrix else NEWTON_ITERATIONS):
        gradient = np.where(fixed, 0.0, model.gradient(point))
        direction, used = _newton_direction(model, point, gradient, fixed, (share, enough, max_products), sharpened)
        products += used
        t = _line_search(model, point, direction)
        before, acted = model.merit(point), model.acting(point)
        point = point.moved(direction, t)
        decrease = before - model.merit(point)
        gained += decrease
        if products > PRODUCTS_OVER_ONE_SYSTEM * max_products:
            break
        if decrease <= max(enough, share * gained) and (not is_matrix or not used or model.acting(point) == acted):
            stalled = stalled + 1 if (excess := model.limits.excess(point.values)) > STALLED * left else 0
            left, updated = excess, model.limits.updated(point.values, model.objective(point), is_matrix)
            if updated is None or stalled >= PATIENCE:
                break
            model = LimitedModel(linear, updated)

    def predicted(t: float) -> float:
        there = ModelPoint(
            t * point.step,
            start.residuals + t * (point.residuals - start.residuals),
            {name: v + t * (point.values[name] - v) for name, v in start.values.items()},
        )
        return model.merit(start) - model.merit(there)

    eased = model.objective(start) - model.objective(point)
    return LimitedStep(point.step, products, predicted, eased, model.limits)


def _newton_direction(
    model: LimitedModel, point: ModelPoint, gradient: Array, fixed: BoolArray, ends: tuple[float, float, int],
    sharpened: Sharpened | None,
) -> tuple[ModelPoint, int]:  # fmt: skip
    """Direction to the minimum of the model with the active limits fixed, and the number of its products."""
    linear = model.linear
    weights = {name: model.limits.curvature(name, v) for name, v in point.values.items()}
    changes: list[tuple[Array, Values]] = []

    def product(d: Array) -> Array:
        residuals, values = linear.jvp(d)
        changes.append((residuals, values))
        weighted = {name: weights[name] * v for name, v in values.items()}
        curved = linear.norm.product(point.residuals, residuals)
        return np.where(fixed, 0.0, linear.vjp(curved, weighted) + linear.regulariser.penalty_product(d))

    inverse = linear.precondition(fixed, sharpened, model.limits, point.values)
    path = conjugate_gradients(product, gradient, inverse, np.inf, *ends)
    direction = ModelPoint(
        path.steps[-1], np.zeros_like(point.residuals), {name: np.zeros_like(v) for name, v in point.values.items()}
    )
    for k, (residuals, values) in enumerate(changes[: len(path.p)]):
        along = path.p[k]
        a = float(along @ (path.steps[k + 1] - path.steps[k])) / float(along @ along)
        direction.residuals += a * residuals
        for name, v in values.items():
            direction.values[name] += a * v
    return direction, len(changes)


def _line_search(model: LimitedModel, point: ModelPoint, direction: ModelPoint) -> float:
    """The minimum of the model along a direction, by bisection of its slope, which increases."""

    def slope(t: float) -> float:
        return model.slope(point.moved(direction, t), direction)

    low, high = 0.0, 1.0
    while slope(high) < 0.0 and high < LONGEST_STEP:
        low, high = high, 2.0 * high
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if slope(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)
