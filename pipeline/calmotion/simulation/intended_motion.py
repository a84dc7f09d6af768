"""What the targets should do: the animation on a rigid robot, or with the sag of each pose."""

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.multibody.analysis.kinematics import rigid_poses, set_rotors, target_frames
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, moves_freely, rigid_model
from calmotion.multibody.model.system import State, allocate_state
from calmotion.multibody.statics.equilibrium import equilibrium
from calmotion.simulation.simulator import Simulator
from calmotion.simulation.target_errors import IntendedMotion


def rigid_motion(
    model: Model, angles: Array, rates: Array, h: float, world: Array | None = None, cyclic: bool = False
) -> IntendedMotion:
    """The animation on a rigid robot: kinematics alone, or a rigid simulation where joints move freely.

    Raises:
        SimulationFailure: The rigid robot cannot follow its motors.
    """
    rigid = rigid_model(model)
    if np.any(moves_freely(rigid)):
        try:
            run = Simulator(rigid, h, world, cyclic).run(angles, rates)
        except SimulationFailure as failure:
            failure.state = None  # of the rigid robot, in which nobody looks for a deflection
            raise
        states = run.trajectory.states
        return IntendedMotion(states.c, states.q, run.target_positions, run.target_rotations)
    c, q = rigid_poses(rigid, rigid.joint_angles(angles), world)
    positions, rotations = target_frames(rigid, c, q, np.zeros(c.shape[:2] + (0,)))
    return IntendedMotion(c, q, positions, rotations)


def rigid_targets(model: Model, angles: Array, world: Array | None = None) -> Array | None:
    """Where a rigid robot has the targets at some instants [m], shape [T, K, 3]; None where joints move freely."""
    rigid = rigid_model(model)
    if np.any(moves_freely(rigid)):
        return None
    c, q = rigid_poses(rigid, rigid.joint_angles(angles), world)
    positions, _ = target_frames(rigid, c, q, np.zeros(c.shape[:2] + (0,)))
    return positions


def static_motion(
    model: Model, rigid: IntendedMotion, angles: Array, judged: BoolArray, world: Array | None = None
) -> IntendedMotion:
    """The animation with the sag of each pose: the flexible robot in static equilibrium at every judged instant.

    Args:
        rigid: Its rigid motion, kept where nothing is judged.
        angles: Of the motors, shape [T, M].
        judged: Shape [T].
        world: Moving roots, at rest in each pose.

    Raises:
        SimulationFailure: A pose without static equilibrium.
    """
    ws, joint_angles = Workspace.for_system(model.system), model.joint_angles(angles)
    intended = IntendedMotion(
        rigid.c.copy(), rigid.q.copy(), rigid.target_positions.copy(), rigid.target_rotations.copy()
    )
    state: State | None = None
    for n in np.flatnonzero(judged):
        if state is None:
            state = allocate_state(model.system)
            state.c[:], state.q[:] = rigid.c[n], rigid.q[n]
            set_rotors(model.system, state, joint_angles[n])
        if world is not None and world.shape[1]:
            ws.work.world[:] = world[n]
            ws.work.world[:, 3:9] = 0.0
        state, _ = equilibrium(model.system, state, joint_angles[n], ws)
        intended.c[n], intended.q[n] = state.c, state.q
        positions, rotations = target_frames(model, state.c[None], state.q[None], state.u[None])
        intended.target_positions[n], intended.target_rotations[n] = positions[0], rotations[0]
    return intended
