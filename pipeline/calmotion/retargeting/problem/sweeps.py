"""The derivatives of all robots of a problem by its unknowns, by tangent and adjoint sweeps."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.parallel import in_parallel
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.response_gram import products_worth
from calmotion.retargeting.problem.robot import LinearRobot, of_robot


class Sweeps:
    """Residuals and limited quantities by the unknowns.

    Args:
        robots: Linearised at a point, the nominal one first.
        space: The n unknowns.
    """

    def __init__(self, robots: Sequence[LinearRobot], space: OffsetSpace):
        self.robots, self.space = tuple(robots), space

    def of(self, space: OffsetSpace) -> Sweeps:
        """By other unknowns, at the same point."""
        return Sweeps(self.robots, space)

    def jvp(self, direction: Array, names: Collection[str]) -> tuple[Array, dict[str, Array]]:
        """Change of the weighted residuals along a direction, shape [S T, R], and of some limited quantities."""
        offsets = self.space.offsets(direction)
        own = [self._own(k, names) for k in range(len(self.robots))]
        found = in_parallel(lambda k: self.robots[k].tangent(*offsets, own[k]), range(len(self.robots)))
        changes = self._curves(direction, names)
        for k, (_, of_run) in enumerate(found):
            changes |= {of_robot(name, k): values for name, values in of_run.items()}
        return found[0][0] if len(found) == 1 else np.concatenate([residuals for residuals, _ in found]), changes

    def vjp(self, residuals: Array, limited: Mapping[str, Array]) -> Array:
        """The transpose of `jvp`, shape [n]."""
        parts = np.split(residuals, len(self.robots))

        def pulled(k: int) -> tuple[Array, Array]:
            own = {name: limited[of_robot(name, k)] for name in self._own(k, limited)}
            return self.robots[k].adjoint(parts[k], own)

        return self._unknowns(in_parallel(pulled, range(len(parts)))) + self._of_curves(limited)

    def continuous_adjoint(self, limited: Mapping[str, Array]) -> Array:
        """The derivatives of half the squared errors by the continuous adjoint, and of limited curves."""
        return self._unknowns(in_parallel(lambda robot: robot.at.continuous_adjoint(), self.robots)) + self._of_curves(
            limited
        )

    def patience(self, first: bool) -> int | None:
        """See `response_gram.products_worth`."""
        return products_worth(self.robots, self.space, first)

    def _own(self, robot: int, names: Collection[str]) -> list[str]:
        """Which limited quantities follow from the run of a robot."""
        return [name for name in self.robots[robot].limited if of_robot(name, robot) in names]

    def _unknowns(self, pulls: Sequence[tuple[Array, Array]]) -> Array:
        """Derivatives by the motors' values and rates, of all robots, gathered by unknown."""
        by_value, by_rate = (
            pulls[0][k] if len(pulls) == 1 else np.sum([pull[k] for pull in pulls], axis=0) for k in (0, 1)
        )
        basis = self.space.basis
        return self.space.gather(basis.values, by_value) + self.space.gather(basis.rates, by_rate)

    def _curves(self, direction: Array, names: Collection[str]) -> dict[str, Array]:
        return {
            name: self.space.spread(spline, direction) for name, spline in self.space.splines.items() if name in names
        }

    def _of_curves(self, limited: Mapping[str, Array]) -> Array:
        pulls = [self.space.gather(s, limited[name]) for name, s in self.space.splines.items() if name in limited]
        return np.sum(pulls, axis=0) if pulls else np.zeros(self.space.size)
