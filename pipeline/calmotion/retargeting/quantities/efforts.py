"""Efforts of the motors, which limits bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.model.model import Model
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.quantities.base import Quantity, RobotChange
from calmotion.simulation.forward import ForwardRun


@dataclass(frozen=True, eq=False)
class Efforts(Quantity):
    """Torques [N m] or forces [N] of the motors of a robot, R = M."""

    model: Model
    by_efforts = True

    def values(self, run: ForwardRun) -> Array:
        """By the reactions of the joints."""
        found = reactions(self.model.system, run.trajectory, run.joint_angles, run.joint_rates)
        return self.model.motor_efforts(found.efforts)

    def slopes(self, run: ForwardRun) -> EffortSlopes:
        """The efforts themselves."""
        return EffortSlopes()

    def rigid_metric(
        self, weights: Array, run: ForwardRun, inertia: Array, space: OffsetSpace
    ) -> tuple[csr_matrix, Array]:
        """Efforts are inertia times acceleration."""
        return space.basis.accelerations, np.einsum("nma,nm,nmb->nab", inertia, weights, inertia)


class EffortSlopes:
    """The changes of efforts that a tangent sweep gives."""

    def change(self, by: RobotChange) -> Array:
        """Of the motors."""
        return _efforts(by)

    def pull(self, values: Array, onto: RobotChange) -> None:
        """By the efforts."""
        _efforts(onto)[...] += values


def _efforts(by: RobotChange) -> Array:
    if by.efforts is None:
        raise ValueError("a quantity that uses the efforts needs `by_efforts = True`")
    return by.efforts
