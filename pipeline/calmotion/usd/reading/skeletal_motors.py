"""Motors' tracks out of a UsdSkel animation.

A motor names a joint of a skeleton. The bodies as authored stand where the skeleton is at rest, and turn with it: with
L(t) the joint's rotation in its parent's axes, D = L(t) L(rest)^T turns the robot's body about axes fixed in the body
before it. One motor takes the part of D about its axis; two or three that name the same joint, one carrying the next,
take a product of rotations about theirs, D = exp(a_1 q_1) exp(a_2 q_2) ..., found by Gauss-Newton from one frame to
the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import ShotError
from ...shot import Track
from ...shot.character import Array
from ..clock import Clock
from ..transforms import pose_from_matrix, rotation_from_quaternion
from .context import Reading
from .motors import SKEL_JOINT, SKELETON, Drive
from .posed_motors import OFF_AXIS, joint_motions
from .skeletons import BoundSkeleton, bound_skeletons, skeleton_with

MOST = 3  # motors that one joint of a skeleton takes
_STEPS, _SMALL = 60, 1e-13


@dataclass(frozen=True, eq=False)
class HingeStack:
    """The motors that perform one joint of a skeleton.

    Attributes:
        skeleton, joint: Which one.
        drives: The motors, from the body that carries them outwards.
        axes: Their axes in the axes of the joint's parent, at rest, shape [m, 3].
        start: Their angles in the pose in which the bodies stand [rad], shape [m].
    """

    skeleton: BoundSkeleton
    joint: int
    drives: tuple[Drive, ...]
    axes: Array
    start: Array

    @property
    def rest(self) -> Array:
        """Rotation of the joint at rest, shape [3, 3]."""
        return pose_from_matrix(self.skeleton.rest[self.joint], str(self.skeleton.prim.GetPath())).rotation

    def turned(self, angles: Array) -> Array:
        """D at angles of the motors [rad], shape [n, m] to [n, 3, 3]."""
        from scipy.spatial.transform import Rotation

        turn = Rotation.identity(len(angles))
        for k, axis in enumerate(self.axes):
            turn = turn * Rotation.from_rotvec((angles[:, k] - self.start[k])[:, None] * axis)
        return turn.as_matrix()


def hinge_stacks(reading: Reading, drives: Sequence[Drive]) -> list[HingeStack]:
    """The joints of skeletons that motors perform.

    Args:
        reading: The stage at the frame at which the bodies stand at rest.
        drives: The motors of the character; those of other sources are passed over.

    Raises:
        ShotError: A joint that no skeleton has, or that more than three motors, or sliding ones, name.
    """
    wanted: dict[str, list[Drive]] = {}
    for drive in drives:
        if drive.source == SKELETON:
            wanted.setdefault(drive.skel_joint, []).append(drive)
    if not wanted:
        return []
    skeletons, found = bound_skeletons(reading.stage), []
    for token, stack in wanted.items():
        with reading.going_on():
            first = stack[0].joint
            skeleton, joint = skeleton_with(skeletons, token, first.path, SKEL_JOINT)
            if len(stack) > MOST or any(drive.joint.kind != "revolute" for drive in stack):
                raise ShotError(
                    "a joint of a skeleton is performed by one, two or three revolute joints",
                    path=first.path,
                    attribute=SKEL_JOINT,
                    found=f"{token} on {', '.join(drive.joint.path for drive in stack)}",
                    remedy="Name another joint of the skeleton, or remove the attribute from what is too many",
                )
            found.append(_stack(reading, skeleton, joint, _outwards(stack)))
    return found


def _outwards(stack: list[Drive]) -> tuple[Drive, ...]:
    """Motors in the order in which they carry each other."""
    carried = {drive.joint.body0: drive for drive in stack}
    first = [d for d in stack if d.joint.body0 not in {other.joint.body1 for other in stack}]
    order = [first[0]] if first else []
    while order and order[-1].joint.body1 in carried and len(order) < len(stack):
        order.append(carried[order[-1].joint.body1])
    if len(order) != len(stack):
        raise ShotError(
            "the motors of one joint of a skeleton must carry each other",
            path=stack[0].joint.path,
            attribute=SKEL_JOINT,
            found=", ".join(drive.joint.path for drive in stack),
            remedy="Put them one after the other, each on the body that the one before turns",
        )
    return tuple(order)


def _stack(reading: Reading, skeleton: BoundSkeleton, joint: int, drives: tuple[Drive, ...]) -> HingeStack:
    place = skeleton.placement(reading.start)
    above = skeleton.parent(joint)
    parent = place if above < 0 else place @ skeleton.in_skeleton(skeleton.rest)[above]
    turn = pose_from_matrix(parent, str(skeleton.prim.GetPath())).rotation
    axes = [turn.T @ _axis(reading, drive) for drive in drives]
    motions = joint_motions(reading, [d.joint for d in drives], np.array([reading.start]))
    return HingeStack(skeleton, joint, drives, np.array(axes), np.array([m.values[0] for m in motions]))


def _axis(reading: Reading, drive: Drive) -> Array:
    """A motor's axis in the world, where the bodies stand."""
    joint = drive.joint
    axis = rotation_from_quaternion(joint.frame1.rotation)[:, 2]
    return reading.pose(reading.stage.GetPrimAtPath(joint.body1)).rotation @ axis


def skeletal_tracks(stack: HingeStack, clock: Clock, reading: Reading) -> dict[str, Track]:
    """Tracks of the motors of a stack, by the path of their joint; a doubt where they cannot follow the skeleton."""
    samples = stack.skeleton.codes()
    codes = clock.merged(samples[(samples >= clock.start) & (samples <= clock.end)])
    D = stack.skeleton.local_rotations(stack.joint, codes) @ stack.rest.T
    angles, off = follow(stack.axes, D)
    worst = int(np.argmax(off))
    if off[worst] > OFF_AXIS:
        names = ", ".join(drive.joint.path for drive in stack.drives)
        reading.doubt(
            ShotError(
                f"{stack.skeleton.joints[stack.joint]} of {stack.skeleton.prim.GetPath()} is animated off the axes of "
                "its motors, which the robot will not do",
                path=names,
                attribute=SKEL_JOINT,
                found=f"{np.degrees(off[worst]):.3g} degrees at time code {codes[worst]:g}",
                remedy="Animate the skeleton as the hinges let it move, or add a motor",
            )
        )
    return {
        drive.joint.path: Track(clock.seconds(codes), start + column)
        for drive, start, column in zip(stack.drives, stack.start, angles.T, strict=True)
    }


def follow(axes: Array, D: Array) -> tuple[Array, Array]:
    """Angles of hinges in a row whose product of rotations comes nearest to given ones.

    Args:
        axes: Unit axes, each in the axes of the first one's base with all angles zero, shape [m, 3], m up to 3.
        D: Rotations, neighbours less than half a turn apart, shape [n, 3, 3].

    Returns:
        Angles, unwrapped [rad], shape [n, m], and the angles of rotation that are left [rad], shape [n].
    """
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_matrix(D)
    if len(axes) == 1:
        quaternion = turns.as_quat()
        angles = np.unwrap(2.0 * np.arctan2(quaternion[:, :3] @ axes[0], quaternion[:, 3]))[:, None]
    else:
        angles, q = np.zeros((len(D), len(axes))), _first(axes, turns[0])
        for n in range(len(D)):
            q = _nearest(axes, turns[n], q)
            angles[n] = q
    return angles, (_product(axes, angles).inv() * turns).magnitude()


def _product(axes: Array, angles: Array):
    from scipy.spatial.transform import Rotation

    turn = Rotation.identity(len(angles))
    for k, axis in enumerate(axes):
        turn = turn * Rotation.from_rotvec(angles[:, k, None] * axis)
    return turn


def _first(axes: Array, turn) -> Array:
    """Angles for the first rotation: the smallest of those that Gauss-Newton finds from several starts."""
    starts = [np.zeros(len(axes)), *(s * 1.5 * e for e in np.eye(len(axes)) for s in (-1.0, 1.0))]
    found = [_nearest(axes, turn, start) for start in starts]
    left = [float((_product(axes, q[None]).inv() * turn).magnitude()[0]) for q in found]
    good = [k for k in range(len(found)) if left[k] < min(left) + 1e-6]
    return found[min(good, key=lambda k: float(np.abs(found[k]).max()))]


def _nearest(axes: Array, turn, q: Array) -> Array:
    """Angles of the product nearest to a rotation, by damped Gauss-Newton."""
    from scipy.spatial.transform import Rotation

    for _ in range(_STEPS):
        left = Rotation.identity()
        columns = []
        for k, axis in enumerate(axes):
            columns.append(left.apply(axis))
            left = left * Rotation.from_rotvec(q[k] * axis)
        J = np.array(columns).T
        error = (turn * left.inv()).as_rotvec()
        step = np.linalg.solve(J.T @ J + 1e-9 * np.eye(len(axes)), J.T @ error)
        q = q + step * min(1.0, 0.7 / max(float(np.max(np.abs(step))), 1e-300))
        if np.max(np.abs(step)) < _SMALL:
            break
    return q
