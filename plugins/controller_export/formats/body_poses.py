"""Poses of the bodies of a rigid robot that performs motor curves, joint by joint, and the motors' values in them.

Formats of animation hold a tree of bodies, each placed at its joint in the axes of the body before it. That place is
called its pivot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Animation, Body, Character, MassProperties, with_ideal_motors
from calmotion.multibody import SimulationFailure, Tree, Workspace, compile_model, moves_freely, rigid_poses, span_tree
from calmotion.simulation import (
    MAX_STEP,
    TimeGrid,
    needed_pre_roll,
    rigid_bodies,
    root_tracks,
    run_forward,
    sample_roots,
    sample_world,
)
from scipy.spatial.transform import Rotation

from ..commands import MotorCurves, instants
from ..playback import over_playing


@dataclass(frozen=True, eq=False)
class BodyTree:
    """The bodies of a character from the world outwards.

    Attributes:
        character: The character.
        tree: Its spanning tree, with B components.
        pivots: Where the joint of each component lies in its body [m], shape [B, 3].
        animation: Of its moving roots.
    """

    character: Character
    tree: Tree
    pivots: Array
    animation: Animation

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The body of each component."""
        return tuple(self.character.bodies[body] for body in self.tree.body)


@dataclass(frozen=True, eq=False)
class LocalPoses:
    """Poses of the pivots in the axes of the bodies before them; of the first ones in the world.

    Attributes:
        times: [s], shape [T].
        translations: [m], shape [T, B, 3].
        rotations: Unit quaternions (w, x, y, z), neighbours in time of the same sign, shape [T, B, 4].
    """

    times: Array
    translations: Array
    rotations: Array


def body_tree(curves: MotorCurves) -> BodyTree:
    """The bodies of the robot that curves drive."""
    assert curves.character is not None and curves.animation is not None
    character, tree = curves.character, span_tree(curves.character)
    pivots = []
    for joint, flipped in zip(tree.joint, tree.flipped, strict=True):
        own = character.joints[joint]
        pivots.append((own.frame0 if flipped else own.frame1).position)
    return BodyTree(character, tree, np.array(pivots).reshape(-1, 3), curves.animation)


def upward(character: Character) -> Rotation:
    """The shortest rotation that turns up, away from gravity, to y."""
    up = -character.gravity if np.any(character.gravity) else np.array([0.0, 0.0, 1.0])
    up, y = up / np.linalg.norm(up), np.array([0.0, 1.0, 0.0])
    axis = np.cross(up, y)
    if not np.any(axis):
        axis = np.array([1.0, 0.0, 0.0])
    return Rotation.from_rotvec(axis / np.linalg.norm(axis) * np.arctan2(np.linalg.norm(np.cross(up, y)), up @ y))


def local_poses(bodies: BodyTree, curves: MotorCurves, rate: float) -> LocalPoses:
    """What the rigid robot does with the curves, at a fixed rate [Hz] from the first frame to the last or just after.

    Raises:
        ShotError: The motors do not determine the motion.
    """
    times = instants(curves, rate, fixed_period=True)
    c, q = _world_poses(bodies, curves, times)
    translations, rotations = np.empty_like(c), np.empty_like(q)
    for k, parent in enumerate(bodies.tree.parent):
        relative = _rotation(q[:, k])
        point = c[:, k] + relative.apply(bodies.pivots[k])
        if parent >= 0:
            back = _rotation(q[:, parent]).inv()
            point, relative = back.apply(point - c[:, parent]), back * relative
        translations[:, k] = point
        rotations[:, k] = _continuous(relative.as_quat(scalar_first=True))
    return LocalPoses(times, translations, rotations)


def motor_values(bodies: BodyTree, poses: LocalPoses) -> Array:
    """Angles [rad] and lengths [m] of the motors in poses, angles without jumps, shape [T, M].

    An angle is that of the rotation about the joint's axis.
    """
    c, q = _composed(bodies, poses)
    character, component = bodies.character, {body: k for k, body in enumerate(bodies.tree.body)}
    values = np.zeros((len(poses.times), len(character.motors)))
    roots = _moving_roots(bodies, poses.times)
    for m, motor in enumerate(character.motors):
        joint = character.joints[motor.joint]
        frames = []
        for body, frame in ((joint.body0, joint.frame0), (joint.body1, joint.frame1)):
            own = _rotation(frame.rotation)
            if body in component:
                k = component[body]
                turn = _rotation(q[:, k])
                frames.append((c[:, k] + turn.apply(frame.position), turn * own))
            else:
                still = (np.broadcast_to(frame.position, (len(poses.times), 3)), own)
                frames.append(roots.get(motor.joint, still))
        (p0, r0), (p1, r1) = frames
        if motor.linear:
            values[:, m] = np.einsum("ij,ij->i", p1 - p0, r0.apply(np.tile([0.0, 0.0, 1.0], (len(p0), 1))))
        else:
            between = (r0.inv() * r1).as_quat()
            values[:, m] = np.unwrap(2.0 * np.arctan2(between[:, 2], between[:, 3]))
    return values


def _moving_roots(bodies: BodyTree, times: Array) -> dict[int, tuple[Array, Rotation]]:
    """Places [m] and rotations of the world's side of joints that the shot moves, by joint."""
    moving = bodies.animation.moving
    if not moving:
        return {}
    world = sample_roots(moving, _even_grid(times))
    return {
        frame.joint: (world[:, k, :3], Rotation.from_matrix(world[:, k, 9:].reshape(-1, 3, 3)))
        for k, frame in enumerate(moving)
    }


def _even_grid(times: Array) -> TimeGrid:
    return TimeGrid(times, 1, 0, float(times[-1] / (len(times) - 1)))


def near_turn(values: Array, curves: MotorCurves) -> Array:
    """Values whose angles begin within half a turn of those of the curves: a pose does not tell whole turns."""
    turns = np.round((curves.at(np.zeros(1))[0] - values[0]) / (2.0 * np.pi))
    linear = np.array([motor.linear for motor in curves.motors], bool)
    return np.asarray(values + np.where(linear, 0.0, 2.0 * np.pi * turns))


def _world_poses(bodies: BodyTree, curves: MotorCurves, times: Array) -> tuple[Array, Array]:
    """Origins [m] and quaternions of the components, shapes [T, B, 3] and [T, B, 4]."""
    character, tree = with_ideal_motors(bodies.character), bodies.tree
    animation = curves.animation
    assert animation is not None
    hollow = replace(character, bodies=tuple(map(_with_mass, character.bodies)))
    model = compile_model(hollow, tree, rigid_bodies(hollow, tree, None), [frame.joint for frame in animation.moving])
    if not tree.closing and not np.any(moves_freely(model)):
        angles = model.joint_angles(curves.at(times))
        return rigid_poses(model, angles, sample_roots(animation.moving, _even_grid(times)))
    return _simulated(bodies, hollow, curves, animation, times)


def _simulated(
    bodies: BodyTree, character: Character, curves: MotorCurves, animation: Animation, times: Array
) -> tuple[Array, Array]:
    """The same where joints close chains: a simulation of the rigid robot, whose steps end at the times."""
    massless = next((body for body in bodies.character.bodies if body.mass is None), None)
    if massless is not None:
        raise ShotError(
            "the motion of a robot with closed chains or free joints needs the mass of each body",
            path=massless.path,
            attribute="physics:mass",
            remedy="Author physics:mass, or use a format of motor commands such as csv",
        )
    period = float(times[1] - times[0])
    substeps = int(np.ceil(period / MAX_STEP - 1e-9))
    h = period / substeps
    pre = max(
        needed_pre_roll(tracks, animation.frame_times) for tracks in (animation.current, root_tracks(animation.moving))
    )
    grid = TimeGrid(times, substeps, int(np.ceil(pre / h - 1e-9)), h)
    tree = bodies.tree
    model = compile_model(character, tree, rigid_bodies(character, tree, None), [f.joint for f in animation.moving])
    angles, rates = (over_playing(grid, curves.at, curves, 0.0, order) for order in (0, 1))
    world = sample_world(character, animation, model, grid)
    try:
        run = run_forward(model, Workspace.for_system(model.system), angles, rates, h, world)
    except SimulationFailure as failure:
        raise ShotError(
            "the rigid robot cannot follow these curves",
            path=character.path,
            found=failure.reason.name,
            remedy="Check the shot with calmotion simulate, or use a format of motor commands such as csv",
        ) from failure
    states = run.trajectory.states
    return states.c[grid.frames], states.q[grid.frames]


def _with_mass(body: Body) -> Body:
    """A body with some mass: where motors determine the motion, no mass plays a part."""
    return body if body.mass is not None else replace(body, mass=MassProperties(1.0, np.zeros(3), np.eye(3)))


def _composed(bodies: BodyTree, poses: LocalPoses) -> tuple[Array, Array]:
    """Origins and quaternions of the bodies in the world, of their local poses."""
    c, q = np.empty_like(poses.translations), np.empty_like(poses.rotations)
    for k, parent in enumerate(bodies.tree.parent):
        turn, point = _rotation(poses.rotations[:, k]), poses.translations[:, k]
        if parent >= 0:
            before = _rotation(q[:, parent])
            turn, point = before * turn, c[:, parent] + before.apply(point)
        q[:, k] = turn.as_quat(scalar_first=True)
        c[:, k] = point - turn.apply(bodies.pivots[k])
    return c, q


def _continuous(quaternions: Array) -> Array:
    """Quaternions, shape [T, 4], whose neighbours have the same sign, so that they are interpolated the short way."""
    flips = np.einsum("ij,ij->i", quaternions[1:], quaternions[:-1]) < 0.0
    signs = np.concatenate([[1.0], np.cumprod(np.where(flips, -1.0, 1.0))])
    return np.asarray(quaternions * signs[:, None])


def _rotation(quaternions: Array) -> Rotation:
    """Rotations of quaternions (w, x, y, z), shape [4] or [T, 4]."""
    return Rotation.from_quat(quaternions, scalar_first=True)
