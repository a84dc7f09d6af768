"""The derivatives of all robots by all unknowns as one matrix.

A product with it takes a hundredth of the time of sweeps over all robots. The minimum of a power mean takes hundreds of
products of one model, and so does a step under limits.
"""

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, BoolArray
from calmotion.multibody.parallel import in_parallel
from calmotion.multibody.sensitivity.linearization import spare_memory
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.response_gram import dense_responses
from calmotion.retargeting.problem.robot import EFFORT, LinearRobot, of_robot
from calmotion.retargeting.problem.sweeps import Sweeps
from calmotion.retargeting.solver.dense_preconditioner import DensePreconditioner, for_each_motor
from calmotion.retargeting.solver.norm import Norm


class Responses(Sweeps):
    """Residuals by the unknowns as a matrix, and the efforts that are limited."""

    MOST_UNKNOWNS = 3000
    SHARE_OF_MEMORY = 0.5
    ROUNDING = 1e-7  # of the largest entry of a matrix, added to its diagonal: responses are of single precision
    BLOCK = 1024  # errors whose rows are in double precision at once

    def __init__(self, robots: Sequence[LinearRobot], space: OffsetSpace, motors: tuple[int, ...]):
        """
        Args:
            robots, space: As of `Sweeps`.
            motors: Whose efforts are limited.
        """
        super().__init__(robots, space)
        self.motors = motors

    @classmethod
    def can_be(cls, robots: Sequence[LinearRobot], space: OffsetSpace, motors: tuple[int, ...]) -> bool:
        """Whether the matrix can be made and stored, and stands for all that counts: not for loops, feet on the ground,
        the play of gears and very long shots."""
        rows = _counted(robots).sum() + len(robots) * len(robots[0].at.errors) * len(motors)
        return (
            all(not robot.residuals and set(robot.limited) == {EFFORT} for robot in robots)
            and space.size <= cls.MOST_UNKNOWNS
            and 4.0 * rows * space.size <= cls.SHARE_OF_MEMORY * spare_memory()
            and all(robot.linear.can_be_blocked() for robot in robots)
        )

    def fits(self, robots: Sequence[LinearRobot], space: OffsetSpace, motors: tuple[int, ...]) -> bool:
        """Whether it is of such robots, unknowns and limits."""
        own, basis = self.space, space.basis
        return (
            self.counted.shape == (len(robots) * len(robots[0].at.errors), robots[0].at.errors.shape[1])
            and self.motors == motors
            and np.array_equal(own.motors, space.motors)
            and np.array_equal(own.basis.knots, basis.knots)
            and own.basis.count == basis.count
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
        return np.concatenate([residuals for residuals, _ in self._by_unknowns])

    @cached_property
    def _by_unknowns(self) -> list[tuple[NDArray[np.float32], NDArray[np.float32]]]:
        """Residuals that count and limited efforts of each robot by the unknowns, shapes [k, n] and [T, e, n]."""
        own = self.robots[0].at.robot.objective.weights != 0.0
        instants = np.flatnonzero(own.any(axis=(1, 2))).astype(np.int32)

        def responded(robot: LinearRobot) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            if robot.known.get("of") != (self.space, self.motors):
                residuals, efforts = dense_responses(robot, self.space, instants, self.motors)
                robot.known.update(of=(self.space, self.motors), rows=(residuals[own[instants]], efforts))
            found: tuple[NDArray[np.float32], NDArray[np.float32]] = robot.known["rows"]
            return found

        return in_parallel(responded, self.robots)

    def jvp(self, direction: Array, names: Collection[str]) -> tuple[Array, dict[str, Array]]:
        """As of `Sweeps`."""
        residuals, changes, single = np.zeros(self.counted.shape), self._curves(direction, names), np.float32(direction)
        residuals[self.counted] = self.rows @ single
        for k, (_, efforts) in enumerate(self._by_unknowns):
            if (name := of_robot(EFFORT, k)) in names:
                changes[name] = np.zeros(self.robots[k].at.run.commands.shape)
                changes[name][:, self.motors] = efforts @ single
        return residuals, changes

    def vjp(self, residuals: Array, limited: Mapping[str, Array]) -> Array:
        """The transpose of `jvp`, shape [n]."""
        pulled = (np.float32(residuals[self.counted]) @ self.rows).astype(float) + self._of_curves(limited)
        for k, (_, efforts) in enumerate(self._by_unknowns):
            if (name := of_robot(EFFORT, k)) in limited:
                pulled += np.float32(limited[name][:, self.motors]).ravel() @ efforts.reshape(-1, self.space.size)
        return pulled

    def roots(self, weights: Mapping[str, Array]) -> Array:
        """Rows of which the squares are the terms of limited efforts, shape [rows, n].

        Args:
            weights: Of the squared changes of limited quantities, shape [T, M] each.
        """
        found = [np.zeros((0, self.space.size))]
        for k, (_, efforts) in enumerate(self._by_unknowns):
            if (name := of_robot(EFFORT, k)) in weights:
                weight = weights[name][:, self.motors]
                found.append(np.sqrt(weight[weight > 0.0])[:, None] * efforts[weight > 0.0])
        return np.concatenate(found)

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
