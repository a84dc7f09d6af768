"""The derivatives of all robots by all unknowns as one matrix.

A product with it takes a hundredth of the time of sweeps over all robots, and the minimum of a power mean takes
hundreds of products of one model. Efforts change as the rigid robot's.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, BoolArray
from calmotion.multibody.parallel import in_parallel
from calmotion.multibody.sensitivity.linearization import spare_memory
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.response_gram import dense_responses
from calmotion.retargeting.problem.robot import EFFORT, LinearRobot
from calmotion.retargeting.problem.sweeps import Sweeps
from calmotion.retargeting.solver.dense_preconditioner import DensePreconditioner, for_each_motor
from calmotion.retargeting.solver.norm import Norm


class Responses(Sweeps):
    """Residuals by the unknowns as a matrix."""

    MOST_UNKNOWNS = 3000
    SHARE_OF_MEMORY = 0.5
    ROUNDING = 1e-7  # of the largest entry of a matrix, added to its diagonal: responses are of single precision
    BLOCK = 1024  # errors whose rows are in double precision at once

    def __init__(self, robots: Sequence[LinearRobot], space: OffsetSpace, inertia: Array):
        """
        Args:
            robots, space: As of `Sweeps`.
            inertia: Efforts by accelerations of the unknowns' motors, shape [T, M, m].
        """
        super().__init__(robots, space)
        self.inertia = inertia

    @classmethod
    def can_be(cls, robots: Sequence[LinearRobot], space: OffsetSpace) -> bool:
        """Whether the matrix can be made and stored, and stands for all that counts: not for loops, feet on the ground,
        the play of gears and very long shots."""
        return (
            all(not robot.residuals and set(robot.limited) == {EFFORT} for robot in robots)
            and space.size <= cls.MOST_UNKNOWNS
            and 4.0 * _counted(robots).sum() * space.size <= cls.SHARE_OF_MEMORY * spare_memory()
            and all(robot.linear.can_be_blocked() for robot in robots)
        )

    def of(self, space: OffsetSpace) -> Sweeps:
        """By other unknowns, at the same point."""
        return Sweeps(self.robots, space)

    def patience(self, first: bool) -> int | None:
        """Nothing is better than the matrix."""
        return None

    @cached_property
    def counted(self) -> BoolArray:
        """Which residuals count, shape [S T, R]."""
        return _counted(self.robots)

    @cached_property
    def rows(self) -> NDArray[np.float32]:
        """These by the unknowns, shape [k, n]."""
        own = self.robots[0].at.robot.objective.weights != 0.0
        instants = np.flatnonzero(own.any(axis=(1, 2))).astype(np.int32)

        def responded(robot: LinearRobot) -> NDArray[np.float32]:
            if robot.known.get("space") is not self.space:
                rows = dense_responses(robot, self.space, instants)[own[instants]]
                robot.known.update(space=self.space, rows=rows)
            return np.asarray(robot.known["rows"])

        return np.concatenate(in_parallel(responded, self.robots))

    def jvp(self, direction: Array, names: Collection[str]) -> tuple[Array, dict[str, Array]]:
        """As of `Sweeps`."""
        residuals, changes = np.zeros(self.counted.shape), self._curves(direction, names)
        residuals[self.counted] = self.rows @ direction.astype(np.float32)
        accelerations = self.space.basis.accelerations @ direction.reshape(self.space.basis.count, -1)
        for name in names:
            if name not in changes:
                changes[name] = np.einsum("nMa,na->nM", self.inertia, accelerations)
        return residuals, changes

    def vjp(self, residuals: Array, limited: Mapping[str, Array]) -> Array:
        """The transpose of `jvp`, shape [n]."""
        pulled = (residuals[self.counted].astype(np.float32) @ self.rows).astype(float) + self._of_curves(limited)
        for name, values in limited.items():
            if name not in self.space.splines:
                accelerations = np.einsum("nMa,nM->na", self.inertia, values)
                pulled += np.asarray(self.space.basis.accelerations.T @ accelerations).ravel()
        return pulled

    def preconditioner(self, norm: Norm, residuals: Array, damping: float = 0.0) -> DensePreconditioner:
        """The matrix of the second derivatives of a norm, and of damping."""
        roots = norm.roots(residuals)[self.counted.reshape(-1, 3).any(axis=1)]
        common, share = norm.lessened(residuals)
        size = self.space.size
        pulls, errors = common[self.counted].reshape(-1, 3), self.rows.reshape(-1, 3, size)
        gram, pulled = np.zeros((size, size)), np.zeros(size)
        for first in range(0, len(errors), self.BLOCK):  # in double precision: what is subtracted leaves little of it
            part = slice(first, first + self.BLOCK)
            changes = errors[part].astype(float)
            rooted = (roots[part] @ changes).reshape(-1, size)
            gram += rooted.T @ rooted
            pulled += pulls[part].ravel() @ changes.reshape(-1, size)
        gram -= share * np.outer(pulled, pulled)
        if damping:
            gram += damping * for_each_motor(self.space.basis.closeness, len(self.space.motors))
        gram[np.diag_indices_from(gram)] += self.ROUNDING * float(gram.diagonal().max(initial=0.0))
        return DensePreconditioner(gram, self.space.penalty, self.space.basis.wraps)


def _counted(robots: Sequence[LinearRobot]) -> BoolArray:
    weights = robots[0].at.robot.objective.weights
    return np.tile(weights.reshape(len(weights), -1) != 0.0, (len(robots), 1))
