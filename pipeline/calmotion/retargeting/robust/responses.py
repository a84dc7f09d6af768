"""A retargeting problem of several robots whose linear model is their responses to all unknowns, as one matrix.

A product with it takes a hundredth of the time of sweeps over all robots, and the minimum of a power mean takes
hundreds of products of one model. Efforts change as the rigid robot's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, BoolArray
from calmotion.multibody.parallel import in_parallel
from calmotion.multibody.sensitivity.linearization import spare_memory
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.problem.response_gram import dense_responses
from calmotion.retargeting.problem.rigid_approximation import EFFORT
from calmotion.retargeting.problem.robot import Robot
from calmotion.retargeting.solver.dense_preconditioner import DensePreconditioner, for_each_motor

_LARGEST, _SHARE = 3000, 0.5  # most unknowns, and most of the free memory
_NOTHING = 1e-7  # of the largest entry of the matrix, added to its diagonal: responses are of single precision
_BLOCK = 1024  # errors whose rows are in double precision at once


class RespondingProblem(RetargetProblem):
    """A problem that is linearised by its responses; where that is not possible, as for loops, feet on the ground, the
    play of gears and very long shots, as any other. Its steps can be damped.

    Attributes:
        damping: Weight of half the squared change of the offsets over time from where it was linearised.
    """

    damping = 0.0
    _rows: NDArray[np.float32] | None = None  # residuals that count by the unknowns, shape [k, n]
    _counted: BoolArray = np.zeros(0, bool)  # which they are, shape [S T, R]

    def linearize(self) -> Array:
        """Linearise at the point evaluated last, and the gradient there; of a point that was, for its norm."""
        if not self.linearized_at(self.x):
            self._rows = self.preconditioner = None
            self._sharpened_x = np.zeros(0)
            in_parallel(Robot.linearize, self.robots)
            self._linearized_x, self._ground_rows = self.x, {}
            if self._possible():
                self._respond()
        if self._rows is None:
            self.preconditioner = None  # that of the rigid robot depends on the norm
        else:
            self._factor(self._rows)
        return self.gradient()

    def jvp(self, direction: Array) -> tuple[Array, dict[str, Array]]:
        """Change of the weighted residuals along a direction, shape [S T, R], and of the limited quantities."""
        if self._rows is None:
            return super().jvp(direction)
        residuals, changes = np.zeros(self._counted.shape), {}
        residuals[self._counted] = self._rows @ direction.astype(np.float32)
        for name in {} if self._acting is None else self._acting.bounds:
            if name in self.space.splines:
                changes[name] = self.space.spread(self.space.splines[name], direction)
            elif name.startswith(EFFORT):
                accelerations = self.space.basis.accelerations @ direction.reshape(self.space.basis.count, -1)
                changes[name] = np.einsum("nMa,na->nM", self._rigid().inertia, accelerations)
        return residuals, changes

    def vjp(self, residuals: Array, limited: dict[str, Array]) -> Array:
        """The transpose of `jvp`: weighted residuals and limited quantities to the unknowns."""
        if self._rows is None:
            return super().vjp(residuals, limited)
        pulled = (residuals[self._counted].astype(np.float32) @ self._rows).astype(float)
        for name, v in limited.items():
            if name in self.space.splines:
                pulled += self.space.gather(self.space.splines[name], v)
            elif name.startswith(EFFORT):
                accelerations = np.einsum("nMa,nM->na", self._rigid().inertia, v)
                pulled += np.asarray(self.space.basis.accelerations.T @ accelerations).ravel()
        return pulled

    def penalty_gradient(self, x: Array) -> Array:
        """Gradient of the regulariser and of the damping."""
        return super().penalty_gradient(x) + self._damped(x - self._center(x))

    def penalty_product(self, x: Array) -> Array:
        """Their matrix times x."""
        return super().penalty_product(x) + self._damped(x)

    def penalty_value(self, x: Array) -> float:
        """The regulariser and the damping."""
        d = x - self._center(x)
        return super().penalty_value(x) + 0.5 * float(d @ self._damped(d))

    def squared(self, d: Array) -> float:
        """The squared change of the offsets over time [rad^2 s]."""
        return float(d @ self._close(d))

    def _center(self, x: Array) -> Array:
        return self._linearized_x if len(self._linearized_x) else x

    def _damped(self, d: Array) -> Array:
        return self.damping * self._close(d)

    def _close(self, d: Array) -> Array:
        return np.asarray(self.space.basis.closeness @ d.reshape(self.space.basis.count, -1)).ravel()

    def _possible(self) -> bool:
        """Whether the matrix can be made and stored, and stands for all that counts."""
        own = self.objective.weights.reshape(len(self.objective.weights), -1) != 0.0
        self._counted = np.tile(own, (len(self.robots), 1))
        return (
            all(robot.ground is None and robot.reversals is None for robot in self.robots)
            and self.size <= _LARGEST
            and 4.0 * self._counted.sum() * self.size <= _SHARE * spare_memory()
            and all(robot.simulator.can_be_blocked() for robot in self.robots)
        )

    def _respond(self) -> None:
        """Make the matrix."""
        own, count = self.objective.weights != 0.0, int(self._counted.sum()) // len(self.robots)
        instants = np.flatnonzero(own.any(axis=(1, 2))).astype(np.int32)
        rows = np.empty((len(self.robots), count, self.size), np.float32)

        def responded(k: int) -> None:
            rows[k] = dense_responses(self.robots[k], self.space, instants)[own[instants]]

        in_parallel(responded, range(len(self.robots)))
        self._rows = rows.reshape(-1, self.size)

    def _factor(self, rows: NDArray[np.float32]) -> None:
        """Precondition with the matrix of the second derivatives here."""
        roots = self.norm.roots(self.residuals)[self._counted.reshape(-1, 3).any(axis=1)]
        common, share = self.norm.lessened(self.residuals)
        pulls, errors = common[self._counted].reshape(-1, 3), rows.reshape(-1, 3, self.size)
        gram, pulled = np.zeros((self.size, self.size)), np.zeros(self.size)
        for first in range(0, len(errors), _BLOCK):  # in double precision: what is subtracted leaves little of it
            part = slice(first, first + _BLOCK)
            changes = errors[part].astype(float)
            rooted = (roots[part] @ changes).reshape(-1, self.size)
            gram += rooted.T @ rooted
            pulled += pulls[part].ravel() @ changes.reshape(-1, self.size)
        gram -= share * np.outer(pulled, pulled)
        gram += self.damping * for_each_motor(self.space.basis.closeness, len(self.space.motors))
        gram[np.diag_indices_from(gram)] += _NOTHING * float(gram.diagonal().max(initial=0.0))
        self.take(DensePreconditioner(gram, self.space.penalty, self.space.basis.wraps), self.x)
