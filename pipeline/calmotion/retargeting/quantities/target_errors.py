"""Errors at the targets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.retargeting.quantities.base import Quantity, RobotChange
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.target_errors import Objective


@dataclass(frozen=True, eq=False)
class TargetErrors(Quantity):
    """The weighted residuals of an objective, R = 6 K (formulation, section 3)."""

    objective: Objective

    def values(self, run: ForwardRun) -> Array:
        """Position, then rotation of each target."""
        residuals, _ = self.objective.residuals(run.target_positions, run.target_rotations)
        return residuals.reshape(len(residuals), -1)

    def slopes(self, run: ForwardRun) -> ErrorSlopes:
        """By the coordinates of the targets' components."""
        states = run.trajectory.states
        _, inverse = self.objective.residuals(run.target_positions, run.target_rotations)
        return ErrorSlopes(self.objective, self.objective.jacobian(states.c, states.q, states.u, inverse))


@dataclass(frozen=True, eq=False)
class ErrorSlopes:
    """Derivatives of the residuals.

    Attributes:
        jacobian: By their component's coordinates, shape [T, K, 6, N].
    """

    objective: Objective
    jacobian: Array

    def change(self, by: RobotChange) -> Array:
        """With the motion."""
        found = self.objective.gather(self.jacobian, by.motion)
        return found.reshape(len(found), -1)

    def pull(self, values: Array, onto: RobotChange) -> None:
        """By the motion."""
        onto.motion += self.objective.scatter(
            self.jacobian, np.ascontiguousarray(values).reshape(self.jacobian.shape[:3])
        )
