"""The rigid robot on its intended motion: inertias, loads and levers of its joints, and the robot with its links."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from calmotion.arrays import Array, BoolArray
from calmotion.model import DRIVE, ON_ERROR, RunSettings, curve_of
from calmotion.multibody import Model, PoseModel, SimulationFailure, VelocityForces, pose_model, rigid_poses
from calmotion.simulation import CompiledShot, compile_shot, prepare
from calmotion.support import rotation_from_quaternion
from scipy.linalg import block_diag, eigh

HIGHEST, MOST = 150.0, 8  # frequency [Hz] up to which modes of the links are used, and the largest number of shapes
OFTEN = 0.01  # at which forces that change with the pose are taken [s]
SMALL = 0.02  # shapes that all modes need by less than this, of the one they need most, are left out


@dataclass(frozen=True, eq=False)
class Mechanics:
    """The rigid robot along the intended motion, on a coarse grid of T instants (M motors, K targets).

    Attributes:
        times: [s], shape [T].
        inertia: About each motor's axis of what it carries [kg m^2 or kg], shape [T, M].
        torque: That moves the rigid robot [N m or N], shape [T, M].
        slope: Change of a motor's torque of gravity with its own value [N m/rad], shape [T, M].
        levers, turns: Derivative of the targets' positions, world [m/rad], and of their rotations, world [rad/rad], by
            the motors, shapes [T, K, 3, M].
        axes: Rotation matrices of the targets, shape [T, K, 3, 3].
        positions: Of the targets, world [m], shape [T, K, 3].
        felt: Acceleration of the targets less gravity, world [m/s^2], shape [T, K, 3].
        pushes: Moment about its foot by which the moving robot and its weight turn what it stands on, less that of
            the first instant [N m], shape [T, 3].
        mass: Inertia of all of it about the foot [kg m^2], shape [T, 3, 3].
        foot: Where it stands, world [m], shape [3].
        gravity: [m/s^2], world, shape [3].
    """

    times: Array
    inertia: Array
    torque: Array
    slope: Array
    levers: Array
    turns: Array
    axes: Array
    positions: Array
    felt: Array
    pushes: Array
    mass: Array
    foot: Array
    gravity: Array


@dataclass(frozen=True, eq=False)
class FlexibleRobot:
    """Small motions of the robot with its links, in poses along the motion (M motors, K targets).

    The n coordinates y are the same in all poses: deflections of the motors' loops, command less joint, shape [M], and
    sizes of deflections of the links that span their modes.

        mass y'' + damping y' + stiffness y + loops = by_acceleration q'' + pushes

    Attributes:
        place: Between which poses the robot is, shape [T].
        mass, damping, stiffness: Without the gains and dampings of the loops, shape [P, n, n].
        by_acceleration: Of the commands, shape [P, n, M].
        targets: Motion of the targets, position in world axes and turn in target axes, shape [P, K, 6, n].
        pushed, pushes: Weight, centrifugal and Coriolis forces, shape [F, n], and when they act [s], shape [F].
    """

    place: Array
    mass: Array
    damping: Array
    stiffness: Array
    by_acceleration: Array
    targets: Array
    pushed: Array
    pushes: Array

    def lowest(self, gains: Array, factor: float = 1.0) -> float:
        """Lowest frequency over the poses [Hz] with loops of these gains, infinite of joints that follow exactly, and a
        factor of the links' frequencies."""
        loops = np.zeros(self.mass.shape[1])
        loops[: len(gains)] = gains
        free = np.flatnonzero(np.isfinite(loops))
        found = [
            eigh(
                (factor**2 * K)[free[:, None], free] + np.diag(loops[free]), M[free[:, None], free], eigvals_only=True
            )[0]
            for M, K in zip(self.mass, self.stiffness, strict=True)
        ]
        return float(np.sqrt(max(min(found), 0.0)) / (2.0 * np.pi))


def command_of(shot: CompiledShot, times: Array) -> Array:
    """The motors' curves at some times, shape [T, M]; their last value stays, or a shot that loops begins again."""
    end, loops = float(shot.animation.frame_times[-1]), shot.character.retarget.cyclic
    inside = times if loops else np.clip(times, 0.0, end)
    columns = [curve_of(track, end, loops)(inside, 0) for track in shot.animation.current]
    return np.stack(columns, axis=1) if columns else np.zeros((len(times), 0))


# long: one chain of products of the same arrays, each used by several of those behind it
def mechanics_of(shot: CompiledShot, times: Array, command: Array) -> Mechanics | None:
    """The rigid robot on a motion of its motors, shape [T, M]; None where joints close chains or move freely."""
    model = shot.model
    system, count = model.system, len(model.system.parent)
    joint_of = {int(motor): joint for joint, motor in enumerate(model.motor) if motor >= 0}
    if len(model.motor) > count or any(joint_of.get(m, count) >= count for m in range(command.shape[1])):
        return None
    world = prepare(shot, RunSettings(pre_roll=0.0)).world[0]
    c, q = rigid_poses(model, model.joint_angles(command), np.repeat(world[None], len(times), axis=0))
    R = rotation_from_quaternion(q)
    carried = _carried(model)
    rates = np.gradient(command, times, axis=0, edge_order=2)
    joints = [joint_of[m] for m in range(command.shape[1])]
    own = np.array([system.side[j, 1] for j in joints])
    sliding = system.sliding[joints].astype(bool)
    axis = np.stack(
        [np.einsum("tik,k->ti", R[:, b], system.rotation[j, 1][:, 2]) for j, b in zip(joints, own, strict=True)], 1
    )
    axis = axis * model.sign[joints][None, :, None]
    hinge = np.stack([c[:, b] + R[:, b] @ system.position[j, 1] for j, b in zip(joints, own, strict=True)], 1)

    def moves(points: Array, owner: Sequence[int]) -> Array:
        """Derivative of points of components by the motors, shape [T, P, 3, M]."""
        by = np.cross(axis[:, None], points[:, :, None] - hinge[:, None])
        by = np.where(sliding[None, None, :, None], axis[:, None], by)
        reached = np.array([[carried[a, b] for a in own] for b in owner])
        return np.swapaxes(np.where(reached[None, :, :, None], by, 0.0), 2, 3)

    center = system.s / system.mass[:, None]
    points = c + np.einsum("tbij,bj->tbi", R, center)
    about = _inertias(system.mass, system.Z, center)
    turning = np.einsum("tbij,bjk,tblk->tbil", R, about, R)
    bodies = range(count)
    by_motor = moves(points, bodies)
    turn = np.where(sliding[None, None, None], 0.0, np.swapaxes(np.repeat(axis[:, None], count, 1), 2, 3))
    turn = turn * np.array([[carried[a, b] for a in own] for b in bodies])[None, :, None]
    speed = np.einsum("tbim,tm->tbi", by_motor, rates)
    spin = np.einsum("tbij,tbjm,tm->tbi", turning, turn, rates)
    force = system.mass[None, :, None] * (np.gradient(speed, times, axis=0, edge_order=2) - system.gravity)
    couple = np.gradient(spin, times, axis=0, edge_order=2)
    torque = np.einsum("tbim,tbi->tm", by_motor, force) + np.einsum("tbim,tbi->tm", turn, couple)
    inertia = np.einsum("b,tbim,tbim->tm", system.mass, by_motor, by_motor)
    inertia += np.einsum("tbim,tbij,tbjm->tm", turn, turning, turn)
    slope = _slopes(system.mass, system.gravity, axis, by_motor, sliding)
    foot = np.mean([c[0, b] + R[0, b] @ system.position[b, 1] for b in bodies if system.parent[b] < 0], axis=0)
    arm = points - foot
    pushes = (np.cross(arm, force) + couple).sum(axis=1)
    spread = np.einsum("b,tb,ij->tij", system.mass, (arm**2).sum(2), np.eye(3))
    spread += turning.sum(1) - np.einsum("b,tbi,tbj->tij", system.mass, arm, arm)
    t = model.targets
    at = c[:, t.component] + np.einsum("tkij,kj->tki", R[:, t.component], t.position)
    felt = np.gradient(np.gradient(at, times, axis=0, edge_order=2), times, axis=0, edge_order=2) - system.gravity
    return Mechanics(
        times, inertia, torque, slope, moves(at, [int(b) for b in t.component]), turn[:, t.component],
        np.einsum("tkij,kjl->tkil", R[:, t.component], t.rotation), at, felt, pushes[0] - pushes,
        spread, foot, np.asarray(system.gravity, float),
    )  # fmt: skip


def flexible_robot(
    shot: CompiledShot, times: Array, command: Array, gains: Array, dampings: Array, poses: int = 40
) -> FlexibleRobot | None:
    """The robot in poses that are spread over a motion of the motors, shape [T, M]; None where no link bends below the
    highest frequency that matters.

    Args:
        gains, dampings: Of the motors' loops, shape [M].

    Raises:
        SimulationFailure: The robot has no equilibrium in one of the poses.
    """
    motors = tuple(
        replace(m, model=DRIVE, position_gain=float(gain), velocity_gain=float(damping), damping_on=ON_ERROR)
        for m, gain, damping in zip(shot.character.motors, gains, dampings, strict=True)
    )
    model = compile_shot(replace(shot.character, motors=motors), shot.animation, shot.bodies).model
    system = model.system
    joint_of = {int(motor): joint for joint, motor in enumerate(model.motor) if motor >= 0}
    joints = [joint_of[m] for m in range(len(gains))]
    rows = [int(system.starts[b] + 6 + system.modes[b]) for b in system.side[joints, 1]]
    rows += [int(system.starts[b] + 6 + k) for b in range(len(system.parent)) for k in range(system.modes[b])]
    sign = np.ones(len(rows))
    sign[: len(gains)] = model.sign[joints]
    world = prepare(shot, RunSettings(pre_roll=0.0)).world[0]
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(command, axis=0)).sum(axis=1))])
    at = np.unique(np.clip(np.searchsorted(way, np.linspace(0.0, way[-1], poses)), 0, len(times) - 1))
    found = [_in_coordinates(pose_model(model, command[k], world), rows, sign) for k in at]
    M, C, K, by, targets, motions = (np.array(part) for part in zip(*found, strict=True))
    count = len(gains)
    K[:, range(count), range(count)] -= gains
    C[:, range(count), range(count)] -= dampings
    shapes = _shapes(M[:, count:, count:], K[:, count:, count:])
    if not shapes.shape[1]:
        return None
    basis = block_diag(np.eye(count), shapes)
    M, C, K = (basis.T @ matrices @ basis for matrices in (M, C, K))
    some = slice(None, None, max(1, round(OFTEN / (times[1] - times[0]))))
    forces, rates = VelocityForces(model, world), np.gradient(command, times, axis=0)
    acting = np.array([forces.with_weight(*both) for both in zip(command[some], rates[some], strict=True)])
    # in the coordinates of the pose before and of that behind, as those of the bodies turn
    place = np.interp(way, way[at], np.arange(len(at)))
    first = np.minimum(place[some].astype(int), max(len(at) - 2, 0))
    second, share = np.minimum(first + 1, len(at) - 1), (place[some] - first)[:, None]
    sides = (np.einsum("fN,fNn->fn", acting, (motions @ basis)[side]) for side in (first, second))
    pushes = -((1.0 - share) * next(sides) + share * next(sides))
    return FlexibleRobot(place, M, C, K, basis.T @ by, targets @ basis, times[some], pushes)


def _shapes(M: Array, K: Array) -> Array:
    """Deflections of the links that span their modes in all poses while the joints hold, most compliant first, shape
    [n, r]: mass and stiffness have shape [P, n, n]."""
    found = []
    for mass, stiffness in zip(M, K, strict=True):
        squares, modes = eigh(stiffness, mass)
        low = (squares > 0.0) & (squares < (2.0 * np.pi * HIGHEST) ** 2)
        found.append(modes[:, low] / squares[low])
    L = np.linalg.cholesky(K.mean(axis=0))
    U, sizes, _ = np.linalg.svd(L.T @ np.concatenate(found, axis=1), full_matrices=False)
    kept = sizes[:MOST] > SMALL * sizes.max(initial=0.0)
    return np.asarray(np.linalg.solve(L.T, U[:, :MOST][:, kept]))


def _in_coordinates(pose: PoseModel, rows: Sequence[int], sign: Array) -> list[Any]:
    """Mass, damping and stiffness in some of the robot's own coordinates, which determine all others; what the
    commands' accelerations do to them, and what they do to the targets and to all coordinates."""
    Y = np.linalg.inv(pose.shapes[rows] * sign[:, None])
    stiffness = Y.T @ (pose.omega[:, None] ** 2 * Y)
    return [
        Y.T @ Y, Y.T @ pose.damping @ Y, stiffness, Y.T @ pose.by_acceleration, pose.targets_by_mode @ Y,
        pose.shapes @ Y,
    ]  # fmt: skip


def _carried(model: Model) -> BoolArray:
    """Whether a component carries another one, or is it, shape [B, B]."""
    parent = model.system.parent
    carried = np.eye(len(parent), dtype=bool)
    for b in range(len(parent)):
        if parent[b] >= 0:
            carried[:, b] |= carried[:, parent[b]]
    return carried


def _inertias(mass: Array, Z: Array, center: Array) -> Array:
    """About the centres of mass in the components' axes, from the integrals of x x^T, shape [B, 3, 3]."""
    own = Z - np.einsum("b,bi,bj->bij", mass, center, center)
    return np.asarray(np.einsum("bkk,ij->bij", own, np.eye(3)) - own)


def _slopes(mass: Array, gravity: Array, axis: Array, by_motor: Array, sliding: BoolArray) -> Array:
    """-sum m g . (a x (a x r)): how the torque of gravity of a hinge changes with its own angle, shape [T, M]."""
    twice = np.cross(axis[:, None], np.swapaxes(by_motor, 2, 3))
    return np.where(sliding, 0.0, -np.einsum("b,tbmi,i->tm", mass, twice, gravity))


__all__ = ["FlexibleRobot", "Mechanics", "SimulationFailure", "command_of", "flexible_robot", "mechanics_of"]
