"""Instantaneous response of the rigid robot to its motors: motions of the bodies and targets, and efforts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.analysis.kinematics import target_jacobians
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.linear_solver.closed_chains import factor_closed_chains, solve_system
from calmotion.multibody.linear_solver.elimination import factor
from calmotion.multibody.model.model import Model
from calmotion.multibody.model.phases import system_held
from calmotion.multibody.model.system import System, allocate_state
from calmotion.multibody.statics.equilibrium import linearize


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


def motor_responses(
    rigid: Model, c: Array, q: Array, joint_angles: Array, motors: IntArray, world: Array, times: Array
) -> tuple[Array, Array]:
    """The rigid robot's response to each motor, the others fixed; closed chains and free joints included.

    With the mass matrix in place of the stiffness, a unit change of a motor's angle gives the derivatives of the poses
    by it (where motors determine them; free joints follow by inertia), and the multipliers are the efforts of a unit
    acceleration: the columns of the mass matrix in the motors' angles.

    It calls the kernels of statics, which are compiled already, one instant at a time.

    Args:
        c, q: Its poses, shapes [T, B, 3], [T, B, 4].
        joint_angles: Of its joints, shape [T, J].
        motors: Which motors, shape [m].
        world: Moving markers, shape [T, W, 18].
        times: Of the poses, from the start of the simulation [s], shape [T].

    Returns:
        (R^T dc, dphi) of each component by each motor [m/rad], [rad/rad], shape [T, B, 6, m]; efforts of all motors
        by the acceleration of each of these [kg m^2], shape [T, M, m].

    Raises:
        SimulationFailure: A pose in which the system is singular.
    """
    system = rigid.system._replace(gravity=np.zeros(3))
    count, joints = len(system.parent), len(system.rows)
    imposed_by = rigid.joint_angles(np.eye(int(max(rigid.motor)) + 1)[motors])
    ws, state = Workspace.for_system(system), allocate_state(system)
    blocks, scratch = ws.blocks, ws.scratch
    x, lam = scratch.x, scratch.lam
    motions = np.zeros((len(c), count, system.size, len(motors)))
    efforts = np.zeros((len(c), len(motors), joints))
    for n in range(len(c)):
        state.c[:], state.q[:], ws.work.world[:] = c[n], q[n], world[n]
        held = system_held(system, world[n])
        linearize(held, state, joint_angles[n], ws)
        blocks.K[:] = blocks.D
        bad = factor(held, blocks, ws.matrix, scratch.solution.block)
        if bad >= 0:
            raise SimulationFailure(float(times[n]), bad, Reason.SINGULAR)
        if joints > count:
            factor_closed_chains(held, ws.matrix, scratch.border)
        for m, imposed in enumerate(imposed_by):
            x[:] = 0.0
            lam[:] = -blocks.by_angle * imposed[:, None]
            solve_system(held, ws.matrix, x, lam, scratch.solution)
            motions[n, :, :, m] = x
            efforts[n, m] = _along_axes(system, ws.work.R, lam)
    by_motor = np.stack([rigid.motor_efforts(efforts[:, m]) for m in range(len(motors))], axis=2)
    return motions, by_motor


def _along_axes(system: System, R: Array, lam: Array) -> Array:
    """Efforts of driven joints from multipliers of shape [J, 6]; those of sliders along the undeformed axis."""
    efforts = lam[:, 5].copy()
    for j in np.flatnonzero(system.sliding):
        parent = system.side[j, 0]
        axis = system.rotation[j, 0, :, 2]
        efforts[j] = (axis if parent < 0 else R[parent] @ axis) @ lam[j, :3]
    return efforts
