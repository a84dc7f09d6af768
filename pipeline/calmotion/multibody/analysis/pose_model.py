"""The robot in a pose as a linear system: modes, what the motors do to them, and what the targets do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lstsq

from calmotion.arrays import Array
from calmotion.multibody.analysis.kinematics import rigid_state, target_jacobians
from calmotion.multibody.analysis.modes import Matrices, matrices_at
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, start_angles
from calmotion.multibody.model.phases import system_held
from calmotion.multibody.model.system import (
    BEYOND_COULOMB,
    FRICTION,
    JOINT_ROWS,
    RATE_SHARE,
    VELOCITY_GAIN,
    State,
    System,
)
from calmotion.multibody.statics.equilibrium import equilibrium


@dataclass(frozen=True, eq=False)
class PoseModel:
    """Small motions about the equilibrium at given inputs of the motors (n modes, M motors, K targets).

    With the inputs q, and amplitudes a of the modes as deviations from the equilibrium at the inputs of the moment,

        a'' + damping a' + omega^2 a = by_acceleration q'' + by_rate q',   targets: by_input dq + by_mode a

    Attributes:
        omega: Angular frequencies [rad/s], ascending, shape [n].
        damping: Of the modes, which may couple [1/s], shape [n, n].
        by_acceleration: Modal force of the inputs' accelerations, shape [n, M].
        by_rate: Of their rates, as of a velocity gain on a joint's own speed [1/s], shape [n, M].
        targets_by_input: The targets' frames (position in world axes, rotation in target axes), shape [K, 6, M].
        targets_by_mode: Shape [K, 6, n].
        shapes: Modes of mass one in all N coordinates of the components, shape [N, n].
        deflections, by_deflection: Coordinates that do not turn with the pose, such as deflections of links and motors,
            by the amplitudes, shape [R, n], and the amplitudes by them; all coordinates where joints move freely.
        by_input: Motion of the equilibrium with the inputs, shape [N, M].
        inertia: Mass matrix in the inputs [kg m^2], shape [M, M].
        resistance: Efforts by the rates of the inputs and of the amplitudes, as of viscous friction, shape [M, M + n].
        state: The equilibrium.
    """

    omega: Array
    damping: Array
    by_acceleration: Array
    by_rate: Array
    targets_by_input: Array
    targets_by_mode: Array
    shapes: Array
    deflections: Array
    by_deflection: Array
    by_input: Array
    inertia: Array
    resistance: Array
    state: State | None = None

    def amplitudes_of(self, other: PoseModel) -> Array:
        """The matrix from amplitudes in another pose to those of the same deflections in this one, [n, n of other]."""
        return np.asarray(self.by_deflection @ other.deflections)


def pose_model(
    model: Model, values: Array, world: Array | None = None, highest: float = np.inf, near: State | None = None
) -> PoseModel:
    """The robot about its equilibrium at motor inputs of shape [M] [rad or m].

    Args:
        world: Moving roots where they stand, shape [W, 18]; needed where the model has any.
        highest: Modes up to this frequency [Hz].
        near: The equilibrium of a pose nearby, from which that of this one is looked for: closed chains may meet in
            several ways. None: from the pose as authored.

    Raises:
        SimulationFailure: No equilibrium.
    """
    angles = start_angles(model, model.joint_angles(np.asarray(values, dtype=float)))
    system, workspace = model.system, Workspace.for_system(model.system)
    if world is not None:
        workspace.work.world[:] = world
        system = system_held(system, world)
    state, _ = equilibrium(system, near or rigid_state(model, angles, world), angles, workspace)
    # friction has a slope at rest alone; the robot moves
    servo = system.servo.copy()
    servo[:, [FRICTION, BEYOND_COULOMB]] = 0.0
    smooth = system._replace(servo=servo)
    found = matrices_at(smooth, state, angles, workspace)
    squares, every = found.modes()
    kept = squares <= (2.0 * np.pi * highest) ** 2
    omega, shapes = np.sqrt(np.maximum(squares[kept], 0.0)), every[:, kept]
    start = system.starts
    rows = np.concatenate([np.arange(first + 6, end) for first, end in zip(start[:-1], start[1:], strict=True)])
    own: Array = every[rows]
    told = np.linalg.matrix_rank(own) == every.shape[1] if own.size else not every.shape[1]
    follows, on_rate = _by_inputs(model, system, found, workspace)
    at = [part[None] for part in (state.c, state.q, state.u)]
    J = _in_all_coordinates(model, target_jacobians(model, *at)[0])
    return PoseModel(
        omega=omega,
        damping=shapes.T @ found.damping @ shapes,
        by_acceleration=-shapes.T @ found.mass @ follows,
        by_rate=-shapes.T @ (found.damping @ follows + on_rate),
        targets_by_input=J @ follows,
        targets_by_mode=J @ shapes,
        shapes=shapes,
        deflections=own[:, kept] if told else shapes,
        by_deflection=np.asarray(np.linalg.pinv(own))[kept] if told else shapes.T @ found.mass,
        by_input=follows,
        inertia=follows.T @ found.mass @ follows,
        resistance=follows.T @ np.concatenate([found.damping @ follows + on_rate, found.damping @ shapes], axis=1),
        state=state,
    )


def _by_inputs(model: Model, system: System, found: Matrices, workspace: Workspace) -> tuple[Array, Array]:
    """How the equilibrium moves with the motors' inputs, and the forces of their rates, shape [N, M] each."""
    blocks, sizes, start = workspace.blocks, 6 + system.elastic, system.starts
    joints, total = len(system.rows), int(start[-1])
    imposed = np.zeros((JOINT_ROWS * joints, joints))
    on_value, on_rate = np.zeros((total, joints)), np.zeros((total, joints))
    for joint, (parent, child) in enumerate(system.side):
        imposed[JOINT_ROWS * joint : JOINT_ROWS * (joint + 1), joint] = -blocks.by_angle[joint]
        if system.sliding[joint] and parent >= 0:
            on_value[start[parent] : start[parent + 1], joint] += blocks.on_parent[joint, : sizes[parent]]
        if system.rotor[joint] >= 0:
            rotor = start[child] + 6 + system.rotor[joint]
            on_value[rotor, joint] += blocks.on_rotor[joint, 0]
            # statics know no rates
            on_rate[rotor, joint] -= system.servo[joint, VELOCITY_GAIN] * system.servo[joint, RATE_SHARE]
    moved = lstsq(found.rows, imposed)[0]
    A, K = found.allowed, found.stiffness
    if A.shape[1]:
        moved = moved - A @ lstsq(A.T @ K @ A, A.T @ (K @ moved + on_value))[0]
    motors = model.joint_angles(np.eye(int(model.motor.max(initial=-1)) + 1)).T
    return moved @ motors, on_rate @ motors


def _in_all_coordinates(model: Model, J: Array) -> Array:
    """The targets' Jacobian, shape [K, 6, N], from that by each one's own component."""
    sizes, start = 6 + model.system.elastic, model.system.starts
    out = np.zeros((len(J), 6, int(start[-1])))
    for k, component in enumerate(model.targets.component):
        out[k, :, start[component] : start[component + 1]] = J[k, :, : sizes[component]]
    return out
