"""Limits of the motors as terms of an augmented Lagrangian: range, velocity, acceleration and effort at every instant.

With c = (v - limit) / scale for the upper side of a quantity v (the lower one alike) and multipliers y >= 0,

    sum over instants and limits of  rho h / 2 (max(0, c + y)^2 - y^2)

is added to the objective, and at each minimum y <- max(0, c + y) (Hestenes 1969, Powell 1969, Rockafellar 1973). Limits
are drawn in by a small share, so that they hold exactly where the search ends.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from calmotion.shot.character import Array, BoolArray
from calmotion.simulation.motor_limits import Bounds

MARGIN = 1e-4  # share of a limit by which it is drawn in
GROWTH, SLOW = 10.0, 0.25  # of the penalty, where a round left more than this share of the violation
STALLED, PATIENCE = 0.8, 3  # so many minima in a row that each leave more than this share: limits are out of reach


@dataclass(eq=False)
class LimitTerms:
    """The terms of the augmented Lagrangian, with their multipliers.

    Attributes:
        bounds: Bounds by quantity.
        judged: Which instants count, shape [T].
        h: Step [s].
        rho: Penalty.
        multipliers: By quantity, upper and lower side, shape [2, T, M].
        left: Largest excess at the last update.
        reached: Largest excess at the last minimum of the whole problem.
        stalled: How many of these in a row hardly changed it.
        on: Whether the terms count. They do once a minimum without them does not keep the limits: from the input,
            which may be far beyond, that minimum is the best start.
    """

    bounds: dict[str, Bounds]
    judged: BoolArray
    h: float
    rho: float
    multipliers: dict[str, Array] = field(default_factory=dict)
    left: float = np.inf
    reached: float = np.inf
    stalled: int = 0
    on: bool = False

    def __post_init__(self) -> None:
        shape = len(self.judged)
        for name, bound in self.bounds.items():
            self.multipliers.setdefault(name, np.zeros((2, shape, len(bound.scale))))

    def _sides(self, name: str, v: Array) -> Array:
        """c of the upper and of the lower side, shape [2, T, M]; very negative where there is no limit."""
        bound = self.bounds[name]
        with np.errstate(invalid="ignore"):
            sides = np.stack([v - bound.upper, bound.lower - v]) / bound.scale + MARGIN
        return np.where(np.isfinite(sides) & self.judged[:, None], sides, -1e30)

    def value(self, values: dict[str, Array]) -> float:
        """The sum of the terms."""
        total = 0.0
        for name in self.bounds if self.on else ():
            y = self.multipliers[name]
            total += float(np.sum(np.maximum(0.0, self._sides(name, values[name]) + y) ** 2 - y**2))
        return 0.5 * self.rho * self.h * total

    def gradient(self, name: str, v: Array) -> Array:
        """Derivative of the terms by a quantity's values, shape [T, M]."""
        upper, lower = np.maximum(0.0, self._sides(name, v) + self.multipliers[name])
        return self.rho * self.h * (upper - lower) / self.bounds[name].scale

    def curvature(self, name: str, v: Array) -> Array:
        """Second derivative of the terms where they act, shape [T, M]."""
        if not self.on:
            return np.zeros(v.shape)
        active = np.sum(self._sides(name, v) + self.multipliers[name] > 0.0, axis=0)
        return active * (self.rho * self.h / self.bounds[name].scale ** 2)

    def excess(self, values: dict[str, Array]) -> float:
        """Largest excess over the limits as they were drawn in, at most 0 where all are kept."""
        return max(float(np.max(self._sides(name, values[name]))) for name in self.bounds)

    def tighten(self, values: dict[str, Array]) -> bool:
        """Switch the terms on where limits are not kept, and update them at a minimum with them: False where all are
        kept, or nothing more can be done."""
        if not self.on:
            self.on = not self.kept(values)
            return self.on
        excess = self.excess(values)
        self.stalled = self.stalled + 1 if excess > STALLED * self.reached else 0
        self.reached = excess
        return self.stalled < PATIENCE and self.update(values)

    def update(self, values: dict[str, Array]) -> bool:
        """New multipliers after a minimum of the model; False, and none, where all limits are kept."""
        excess = self.excess(values)
        if excess <= MARGIN:
            return False
        for name, y in self.multipliers.items():
            self.multipliers[name] = np.maximum(0.0, self._sides(name, values[name]) + y)
        if excess > SLOW * self.left:
            self.rho *= GROWTH
            for name in self.multipliers:
                self.multipliers[name] /= GROWTH  # they stand for y rho
        self.left = excess
        return True

    def without(self, motor: int, quantity: str) -> LimitTerms:
        """The same terms but for one limit of one motor."""
        bound = self.bounds[quantity]
        lower, upper = bound.lower.copy(), bound.upper.copy()
        lower[motor], upper[motor] = -np.inf, np.inf
        bounds = self.bounds | {quantity: Bounds(lower, upper, bound.scale)}
        return LimitTerms(bounds, self.judged, self.h, self.rho, dict(self.multipliers), on=self.on)

    def binds(self, motor: int, quantity: str, v: Array) -> bool:
        """Whether a limit of a motor acts at any instant, at values of shape [T, M]."""
        return bool(np.any(self.curvature(quantity, v)[:, motor] > 0.0))

    def kept(self, values: dict[str, Array]) -> bool:
        """Whether all limits are kept."""
        return self.excess(values) <= MARGIN
