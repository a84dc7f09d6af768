"""What a shot does to each body, from a simulation of the rigid robot: it decides which modes the bodies need."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array
from calmotion.mesh.mass import mass_of_tets
from calmotion.mesh.parts import makeup_of
from calmotion.model import Animation, Character, FEMeshes
from calmotion.model.character import with_ideal_motors
from calmotion.multibody.analysis import kinematics
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, body_anchors, compile_model, moves_freely, rigid_body
from calmotion.multibody.model.topology import Tree, chain_members
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.simulation.forward import ForwardRun, reactions_at, run_forward
from calmotion.simulation.inputs.contacts import sample_world
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.inputs.open_chains import refuse_open_chains, refuse_open_failure
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.standing.slipping import refuse_slipping
from calmotion.support.rotations import rotation_from_quaternion

_POWER_LEFT = 1e-3  # of a signal's power may lie above the highest frequency that matters: 3% of its amplitude
_NOTHING = 1e-9  # of gravity, or of it over a metre: an acceleration that is rounding


def shot_load_envelopes(
    character: Character, animation: Animation, grid: TimeGrid, tree: Tree, meshes: FEMeshes | None
) -> tuple[LoadEnvelope, ...]:
    """LoadEnvelope of every body of a shot.

    Args:
        character: The bodies; flexible ones count with the mass of their mesh.
        animation: Tracks of the motors, and moving roots.
        grid: Time grid of the shot, pre-roll included.

    Returns:
        One for each body of the character; interfaces in the order of the joints of `body_anchors`.

    Raises:
        SimulationFailure: The rigid robot cannot follow the tracks.
    """
    model, run = rigid_run(character, animation, grid, tree, rigid_bodies(character, tree, meshes))
    return excitation_of(character, model, run, grid.h)


def rigid_run(
    character: Character, animation: Animation, grid: TimeGrid, tree: Tree, bodies: Sequence[ReducedBody]
) -> tuple[Model, ForwardRun]:
    """The animation on a robot of rigid bodies, see `rigid_bodies`: its model and its motion.

    Raises:
        SimulationFailure: It cannot follow the tracks.
    """
    model, angles, rates, world = _compiled(character, animation, grid, tree, bodies)
    return model, run_forward(model, Workspace.for_system(model.system), angles, rates, grid.h, world)


@dataclass(frozen=True, eq=False)
class RigidPoses:
    """The poses of a rigid robot in a shot.

    Attributes:
        model: The rigid robot.
        c, q: Origins [m] and quaternions of its components, shapes [T, B, 3] and [T, B, 4].
        joint_angles: Of its motors' joints, shape [T, J] [rad] or [m].
        world: Moving roots, see `roots.sample_roots`.
        h: Step [s].
    """

    model: Model
    c: Array
    q: Array
    joint_angles: Array
    world: Array
    h: float


def rigid_poses(
    character: Character, animation: Animation, grid: TimeGrid, tree: Tree, bodies: Sequence[ReducedBody],
    tolerance: float | None = None,
) -> RigidPoses:  # fmt: skip
    """The poses of a rigid robot with ideal motors: kinematics alone, and a simulation only where joints move freely or
    close chains.

    Where motors determine the motion, masses play no part.

    Args:
        character, animation, grid, tree, bodies: As of `rigid_run`.
        tolerance: At the targets [m]; None: that of the shot.

    Raises:
        SimulationFailure: It cannot follow the tracks.
        ShotError: Motors contradict each other in a closed chain.
    """
    model, angles, rates, world = _compiled(with_ideal_motors(character), animation, grid, tree, bodies)
    joint_angles = model.joint_angles(angles)
    if not tree.closing and not np.any(moves_freely(model)):
        c, q = kinematics.rigid_poses(model, joint_angles, world)
        return RigidPoses(model, c, q, joint_angles, world, grid.h)
    try:
        run = run_forward(model, Workspace.for_system(model.system), angles, rates, grid.h, world)
    except SimulationFailure as failure:
        refuse_open_failure(character, model, grid, joint_angles, world, failure)
        raise
    refuse_open_chains(character, model, grid, run, tolerance)
    refuse_slipping(character, model, grid, run, tolerance)
    return RigidPoses(model, run.trajectory.states.c, run.trajectory.states.q, joint_angles, world, grid.h)


def _compiled(
    character: Character, animation: Animation, grid: TimeGrid, tree: Tree, bodies: Sequence[ReducedBody]
) -> tuple[Model, Array, Array, Array]:
    """The model, the motors' angles and rates on the grid, shape [T, M], and the moving roots."""
    model = compile_model(character, tree, bodies, [frame.joint for frame in animation.moving])
    world = sample_world(character, animation, model, grid)
    return model, *sample_tracks(animation.tracks, grid), world


def rigid_bodies(character: Character, tree: Tree, meshes: FEMeshes | None) -> list[ReducedBody]:
    """Every body as a rigid one."""
    mesh_of = {} if meshes is None else {mesh.body: mesh for mesh in meshes.meshes}
    result = []
    for index, (body, anchors) in enumerate(zip(character.bodies, body_anchors(character, tree), strict=True)):
        if body.flexible is not None and body.simulated_flexible and index in mesh_of:
            mesh, own = mesh_of[index], None if body.mass is None else body.mass.mass
            material = body.flexible.material
            makeup = makeup_of(mesh.points, mesh.tets, material)
            found = mass_of_tets(mesh.points, mesh.tets, material.density, own, makeup)
            body = replace(body, mass=found)
        result.append(rigid_body(body, anchors))
    return result


def excitation_of(character: Character, model: Model, run: ForwardRun, h: float) -> tuple[LoadEnvelope, ...]:
    """LoadEnvelope of every body in a simulation of the rigid robot with step h [s]; see `shot_load_envelopes`."""
    system, tree, states = model.system, model.tree, run.trajectory.states
    omega = states.V[:, :, 3:6]
    acceleration = np.gradient(states.V[:, :, :3], h, axis=0) if len(states.c) > 1 else np.zeros_like(states.c)
    angular = np.gradient(omega, h, axis=0) if len(states.c) > 1 else np.zeros_like(omega)
    reach = _reach(model, run)
    transmitted = reactions_at(model, run, slice(None))
    force, moment = transmitted.forces, transmitted.moments
    closed = _in_loops(model)
    component_of = {body: k for k, body in enumerate(tree.body)}
    number = {joint: k for k, joint in enumerate((*tree.joint, *tree.closing))}
    result = []
    for index, anchors in enumerate(body_anchors(character, tree)):
        b = component_of[index]
        R = rotation_from_quaternion(states.q[:, b])
        felt = np.einsum("tji,tj->ti", R, acceleration[:, b] - system.gravity)
        peaks = np.zeros((len(anchors.joints), 6))
        far = np.zeros(len(anchors.joints))
        own = [number.get(joint, -1) for joint in anchors.joints]
        for row, k in enumerate(own):
            if row == anchors.root or k < 0:
                continue  # a redundant joint carries nothing
            peaks[row, :3] = _peak(np.einsum("tji,tj->ti", R, force[:, k]))
            peaks[row, 3:] = _peak(np.einsum("tji,tj->ti", R, moment[:, k]))
            far[row] = reach[k] if k < len(reach) else 0.0
            if b in closed:
                # what is beyond it closes the loop: a turn moves it about the body's other end
                ends = [system.position[j, int(system.side[j, 1] == b)] for j in (k, own[anchors.root])]
                far[row] = max(far[row], float(np.linalg.norm(ends[0] - ends[1])))
        center = acceleration[:, b] + _carried_center(system.s[b] / system.mass[b], R, omega[:, b], angular[:, b])
        result.append(
            LoadEnvelope(
                _peak(felt), _peak(angular[:, b]), _peak(omega[:, b]), peaks[:, :3], peaks[:, 3:],
                max(highest_frequency(center, h), highest_frequency(angular[:, b], h)), far, b in closed,
            )
        )  # fmt: skip
    return tuple(result)


def _in_loops(model: Model) -> set[int]:
    """Components that are part of a closed loop."""
    system = model.system
    closing = range(len(system.parent), len(system.rows))
    return set().union(*(chain_members(system.parent, system.side[joint]) for joint in closing))


def highest_frequency(signal: Array, h: float) -> float:
    """Frequency [Hz] below which all but 0.1% of the power of a signal of shape [T, k] lies; 0 for one that rests."""
    # values stay where they begin and end, so the mean is taken out before the window takes the ends down
    swing = signal - signal.mean(axis=0)
    if len(signal) < 4 or np.abs(swing).max(initial=0.0) <= _NOTHING * 9.81:
        return 0.0
    power = (np.abs(np.fft.rfft(swing * np.hanning(len(signal))[:, None], axis=0)) ** 2).sum(axis=1)
    share = np.cumsum(power) / power.sum()
    return float(np.fft.rfftfreq(len(signal), h)[np.searchsorted(share, 1.0 - _POWER_LEFT)])


def _carried_center(center: Array, R: Array, omega: Array, angular: Array) -> Array:
    """Acceleration of the center of mass relative to the origin, world axes, shape [T, 3]."""
    local = np.cross(angular, center) + np.cross(omega, np.cross(omega, center))
    return np.asarray(np.einsum("tij,tj->ti", R, local))


def _reach(model: Model, run: ForwardRun) -> Array:
    """Longest distance of each component's joint to a target that it carries, over the shot [m], shape [B]."""
    system, states = model.system, run.trajectory.states
    reach = np.zeros(len(system.parent))
    for target, b in enumerate(model.targets.component):
        k = int(b)
        while k >= 0:
            joint = states.c[:, k] + rotation_from_quaternion(states.q[:, k]) @ system.position[k, 1]
            distance = np.linalg.norm(run.target_positions[:, target] - joint, axis=1)
            reach[k] = max(reach[k], float(distance.max()))
            k = int(system.parent[k])
    return reach


def _peak(signal: Array) -> Array:
    return np.asarray(np.abs(signal).max(axis=0))
