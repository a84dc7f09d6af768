"""Limits of the motors as terms of an augmented Lagrangian: range, velocity, acceleration and effort at every instant.

With c = (v - limit) / scale for the upper side of a quantity v (the lower one alike) and multipliers y >= 0,

    sum over instants and limits of  rho h / 2 (max(0, c + y)^2 - y^2)

is added to the objective, and at each minimum y <- max(0, c + y) (Hestenes 1969, Powell 1969, Rockafellar 1973). Limits
are narrowed by a small share, so that the original limits hold exactly at the end of the search.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model.limits.bounds import Bounds

FIRST_PENALTY = 1e3  # over the objective for each second
MARGIN = 1e-4  # share by which a limit is narrowed
GROWTH, SLOW = 10.0, 0.25  # the penalty grows by the first if an update leaves more than the second of the violation
MOST = 1e6  # of the penalty beside the objective: with less, the terms of limits keep curves away from them
STALLED, PATIENCE = 0.8, 3  # updates end after so many minima in a row that each leave more than this share of it


@dataclass(frozen=True, eq=False)
class LimitTerms:
    """The terms of the augmented Lagrangian, with their multipliers; a search goes from one to the next.

    Attributes:
        bounds: Bounds by quantity.
        judged: Instants at which limits must hold, shape [T], bool.
        h: Step [s].
        rho: Penalty.
        multipliers: By quantity, upper and lower side, shape [2, T, M].
        left: Largest excess at the last update.
        reached: Largest excess at the last minimum of the problem.
        stalled: Number of minima in a row that hardly reduced it.
        first: The penalty at the first update; 0 before.
        shifts: What is added to the values of a quantity at each instant, shape [T, M].
        on: Whether the terms are part of the merit. They are once a minimum without them violates limits; that minimum
            is a better start than the input, which may violate them by far.
    """

    bounds: dict[str, Bounds]
    judged: BoolArray
    h: float
    rho: float
    multipliers: dict[str, Array] = field(default_factory=dict)
    left: float = np.inf
    reached: float = np.inf
    stalled: int = 0
    first: float = 0.0
    shifts: dict[str, Array] = field(default_factory=dict)
    on: bool = False

    def __post_init__(self) -> None:
        zero = {name: np.zeros((2, len(self.judged), len(bound.scale))) for name, bound in self.bounds.items()}
        object.__setattr__(self, "multipliers", zero | self.multipliers)

    @classmethod
    def of(cls, bounds: Mapping[str, Bounds], judged: BoolArray, h: float) -> LimitTerms | None:
        """Terms that do not count yet; None without bounds."""
        return cls(dict(bounds), judged, h, 1.0) if bounds else None

    def shifted(self, name: str, by: Array | None) -> LimitTerms:
        """The same with more of a quantity at the J judged instants, shape [J, M]; not where they are others."""
        if by is None or name not in self.bounds or len(by) != np.count_nonzero(self.judged):
            return self
        every = np.zeros((len(self.judged), by.shape[1]))
        every[self.judged] = by
        return replace(self, shifts=self.shifts | {name: every})

    def _sides(self, name: str, v: Array) -> Array:
        """c of the upper and of the lower side, shape [2, T, M]; very negative where there is no limit."""
        bound = self.bounds[name]
        with np.errstate(invalid="ignore"):
            v = v + self.shifts.get(name, 0.0)
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
        """Derivative of the terms with respect to the values of a quantity, shape [T, M]."""
        upper, lower = np.maximum(0.0, self._sides(name, v) + self.multipliers[name])
        derivative: Array = self.rho * self.h * (upper - lower) / self.bounds[name].scale
        return derivative

    def curvature(self, name: str, v: Array) -> Array:
        """Second derivative of the terms where they act, shape [T, M]."""
        if not self.on:
            return np.zeros(v.shape)
        active = np.sum(self._sides(name, v) + self.multipliers[name] > 0.0, axis=0)
        second: Array = active * (self.rho * self.h / self.bounds[name].scale ** 2)
        return second

    def curvatures(self, values: dict[str, Array]) -> dict[str, Array]:
        """Second derivatives of the terms by quantity, shape [T, M] each."""
        return {name: self.curvature(name, v) for name, v in values.items()}

    def excess(self, values: dict[str, Array]) -> float:
        """Largest excess over the narrowed limits; at most 0 if all are kept."""
        return max((float(np.max(self._sides(name, values[name]))) for name in self.bounds), default=-np.inf)

    def tightened(self, values: dict[str, Array], objective: float) -> LimitTerms | None:
        """The terms switched on if limits are violated, or with new multipliers at a minimum with the terms; None if
        all limits are kept or further updates do not help.

        Args:
            values, objective: As of `updated`.
        """
        if not self.on:
            return None if self.kept(values) else replace(self, on=True)
        excess = self.excess(values)
        stalled = self.stalled + 1 if excess > STALLED * self.reached else 0
        return replace(self, stalled=stalled, reached=excess).updated(values, objective) if stalled < PATIENCE else None

    def updated(self, values: dict[str, Array], objective: float, grows: bool = True) -> LimitTerms | None:
        """With new multipliers after a minimum of the model; None if all limits are kept.

        Args:
            values: Of the limited quantities there, by name, shape [T, M] each.
            objective: The objective there, without the terms. That of the input says little of the penalty that counts
                beside it: a stiff robot has almost no error before limits bend its motion.
            grows: Whether the penalty may.
        """
        excess = self.excess(values)
        if excess <= MARGIN:
            return None
        multipliers = {
            name: np.maximum(0.0, self._sides(name, values[name]) + y) for name, y in self.multipliers.items()
        }
        first, rho = max(self.first or self.rho, self.penalty_beside(objective)), self.rho
        if grows and excess > SLOW * self.left and rho < MOST * first:
            rho *= GROWTH
            multipliers = {name: y / GROWTH for name, y in multipliers.items()}  # y rho stays the same
        return replace(self, multipliers=multipliers, first=first, rho=rho, left=excess)

    def penalty_beside(self, objective: float) -> float:
        """The penalty with which a search begins that has an objective."""
        return FIRST_PENALTY * objective / (self.h * np.count_nonzero(self.judged))

    def without(self, motor: int, quantity: str) -> LimitTerms:
        """The same terms without one limit of one motor."""
        bound = self.bounds[quantity]
        lower, upper = bound.lower.copy(), bound.upper.copy()
        lower[motor], upper[motor] = -np.inf, np.inf
        bounds = self.bounds | {quantity: Bounds(lower, upper, bound.scale)}
        return replace(self, bounds=bounds)

    def binds(self, motor: int, quantity: str, v: Array) -> bool:
        """Whether a limit of a motor acts at any instant, at values of shape [T, M]."""
        return bool(np.any(self.curvature(quantity, v)[:, motor] > 0.0))

    def bounded(self, quantity: str) -> tuple[int, ...]:
        """Motors of which a quantity has limits."""
        if (bound := self.bounds.get(quantity)) is None:
            return ()
        return tuple(np.flatnonzero(np.isfinite(bound.lower) | np.isfinite(bound.upper)).tolist())

    def kept(self, values: dict[str, Array]) -> bool:
        """Whether all limits are kept."""
        return self.excess(values) <= MARGIN
