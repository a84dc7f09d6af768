"""The part of the merit that is not errors, about a point: regulariser, limits of the motors, and a trust region."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from calmotion.arrays import Array
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.rigid_approximation import EFFORT, limit_metrics
from calmotion.retargeting.solver.dense_preconditioner import add_terms, for_each_motor


@dataclass(frozen=True, eq=False)
class RestOfMerit:
    """The rest for changes d of the unknowns from a point; efforts change as those of the rigid robot.

    Attributes:
        space: The n unknowns.
        x: The point, shape [n].
        limits: Terms of the limits; None where there are none.
        limited: Values of the limited quantities at the point, shape [T, M] each.
        inertia: Efforts by accelerations of the unknowns' motors, shape [T, M, m].
        damping: Weight of half the squared change of the offsets: the smaller the trust region, the larger.
    """

    space: OffsetSpace
    x: Array
    limits: LimitTerms | None
    limited: dict[str, Array]
    inertia: Array
    damping: float = 0.0

    def value(self, d: Array) -> float:
        """The rest, without a constant."""
        value = self.space.penalty_value(self.x + d) + 0.5 * self.damping * self.squared(d)
        return value if self.limits is None else value + self.limits.value(self._changed(d))

    def derivatives(self, d: Array) -> tuple[Array, Array]:
        """Gradient, shape [n], and second derivatives, shape [n, n]."""
        matrix = self._quadratic.copy()
        gradient = self.space.penalty_gradient(self.x + d) + self.damping * self._close(d)
        if self.limits is not None:
            changed = self._changed(d)
            for name, v in changed.items():
                gradient += self._pulled(name, self.limits.gradient(name, v))
            terms = limit_metrics(self.inertia, self.space, self.limits.curvatures(changed))
            if terms:
                add_terms(matrix, (self.space.basis.count, len(self.space.motors), self.space.basis.wraps), terms)
        return gradient, matrix

    def multiplied(self, d: Array) -> tuple[float, Array]:
        """The excess over the limits times its multipliers, at most zero where all limits are kept, and its gradient,
        shape [n], where the multipliers are those of a change."""
        total, gradient = 0.0, np.zeros(self.space.size)
        if self.limits is not None:
            for name, v in self._changed(d).items():
                total += self.limits.multiplied(name, v)
                gradient += self._pulled(name, self.limits.gradient(name, v))
        return total, gradient

    def squared(self, d: Array) -> float:
        """The squared change of the offsets over time [rad^2 s]."""
        return float(d @ self._close(d))

    @cached_property
    def _quadratic(self) -> Array:
        penalty = self.space.penalty + self.damping * self.space.basis.closeness
        return for_each_motor(penalty, len(self.space.motors))

    def _close(self, d: Array) -> Array:
        return np.asarray(self.space.basis.closeness @ d.reshape(self.space.basis.count, -1)).ravel()

    def _changed(self, d: Array) -> dict[str, Array]:
        """The limited quantities at a change."""
        coefficients, found = d.reshape(self.space.basis.count, -1), {}
        for name, v in self.limited.items():
            if name in self.space.splines:
                v = v + self.space.spread(self.space.splines[name], d)
            elif name.startswith(EFFORT):
                accelerations = self.space.basis.accelerations @ coefficients
                v = v + np.einsum("nMa,na->nM", self.inertia, accelerations)
            found[name] = v
        return found

    def _pulled(self, name: str, by_value: Array) -> Array:
        """The transpose of the change of a limited quantity."""
        if name in self.space.splines:
            return self.space.gather(self.space.splines[name], by_value)
        if name.startswith(EFFORT):
            pulled = np.einsum("nMa,nM->na", self.inertia, by_value)
            return np.asarray(self.space.basis.accelerations.T @ pulled).ravel()
        return np.zeros(self.space.size)
