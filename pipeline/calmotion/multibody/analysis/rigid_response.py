"""Response of the rigid robot's targets and motor efforts to its motors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.analysis.kinematics import target_jacobians
from calmotion.multibody.analysis.motor_response import motor_responses
from calmotion.multibody.model.model import Model


@dataclass(frozen=True, eq=False)
class RigidResponse:
    """Derivatives of the rigid robot's targets and efforts by its motors, at some instants of a motion.

    Attributes:
        targets: Targets' frames by motor angles, shape [T, K, 6, m]: position in world axes [m/rad], rotation
            in target axes [rad/rad].
        inertia: Efforts of all motors by motor accelerations [kg m^2], shape [T, M, m].
    """

    targets: Array
    inertia: Array

    @classmethod
    def along(
        cls, rigid: Model, c: Array, q: Array, joint_angles: Array, motors: IntArray, world: Array, times: Array,
        stride: int = 1,
    ) -> RigidResponse:  # fmt: skip
        """The response along a motion; computed at every `stride`-th instant and constant in between, which suffices
        for a preconditioner.

        Args:
            c, q: Its poses, shapes [T, B, 3], [T, B, 4].
            joint_angles: Of its joints, shape [T, J].
            motors: Those that may change, shape [m].
            world: Moving markers, shape [T, W, 18].
            times: Of the poses, from the start of the simulation [s], shape [T].
            stride: Distance of the instants at which it is computed.

        Raises:
            SimulationFailure: A pose in which the system is singular.
        """
        few = slice(None, None, stride)
        c, q = np.ascontiguousarray(c[few]), np.ascontiguousarray(q[few])
        motions, inertia = motor_responses(rigid, c, q, joint_angles[few].copy(), motors, world[few].copy(), times[few])
        J = target_jacobians(rigid, c, q, np.zeros(c.shape[:2] + (0,)))
        targets = J @ motions[:, rigid.targets.component]
        nearest = np.minimum(np.arange(len(joint_angles)) // stride, len(c) - 1)
        return cls(targets[nearest], inertia[nearest])

    def coupled(self, coupling: Array) -> RigidResponse:
        """The response to motors with others geared to them; `coupling` of shape [m, leaders]."""
        if np.array_equal(coupling, np.eye(len(coupling))):
            return self
        return RigidResponse(self.targets @ coupling, self.inertia @ coupling)
