"""Tracks of motors from a UsdSkel animation.

A motor names a joint of a skeleton. The bodies as authored stand where the skeleton is at rest, or as at the first
frame (`calm:motor:skelPose`), and turn with it: with L(t) the joint's rotation in its parent's axes, the product
D = L(t) L(there)^T turns the robot's body about axes fixed in the body before it. One motor takes the part of D about
its axis; two or three that name the same joint, one carrying the next, take a product of rotations about theirs
(`calmotion.rigging.hinge_rows`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Track
from calmotion.rigging.hinge_rows import follow
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd import schemas
from calmotion.usd.clock import Clock
from calmotion.usd.reading.animated import moves
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.motors.driven_motors import SKEL_JOINT, SKELETON, Drive
from calmotion.usd.reading.motors.posed_motors import GAP_TOLERANCE, TILT_TOLERANCE, joint_motions
from calmotion.usd.reading.skeletons import BoundSkeleton, bound_skeletons, skeleton_with
from calmotion.usd.transforms import pose_from_matrix

SKEL_POSE = "calm:motor:skelPose"
MOST = 3  # motors that one joint of a skeleton takes


@dataclass(frozen=True, eq=False)
class HingeStack:
    """The motors that perform one joint of a skeleton.

    Attributes:
        skeleton, joint: Which one.
        drives: The motors, from the body that carries them outwards.
        reference: Rotation of the joint in its parent's axes where the bodies stand, shape [3, 3].
        axes: Their axes in the axes of the joint's parent there, shape [m, 3].
        start: Their angles there [rad], shape [m].
    """

    skeleton: BoundSkeleton
    joint: int
    drives: tuple[Drive, ...]
    reference: Array
    axes: Array
    start: Array

    def turned(self, angles: Array) -> Array:
        """D at angles of the motors [rad], shape [n, m] to [n, 3, 3]."""
        turn = Rotation.identity(len(angles))
        for k, axis in enumerate(self.axes):
            turn = turn * Rotation.from_rotvec((angles[:, k] - self.start[k])[:, None] * axis)
        rotations: Array = turn.as_matrix()
        return rotations


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
        with reading.collecting_problems():
            first = stack[0].joint
            skeleton, joint = skeleton_with(skeletons, token, first.path, SKEL_JOINT)
            if len(stack) > MOST or any(drive.joint.kind != "revolute" for drive in stack):
                raise ShotError(
                    "a joint of a skeleton is performed by one, two or three revolute joints",
                    path=first.path,
                    attribute=SKEL_JOINT,
                    found=f"{token} on {', '.join(drive.joint.path for drive in stack)}",
                    remedy="Name another joint of the skeleton, or remove the attribute from the surplus motors",
                )
            found.append(_stack(reading, skeleton, joint, _outwards(stack)))
            if skeleton.animation is None:
                reading.warn(
                    ShotError(
                        "the skeleton has no animation, so that its motors stand still",
                        path=skeleton.prim.GetPath(),
                        attribute="skel:animationSource",
                        remedy="Name its SkelAnimation there, with SkelBindingAPI applied",
                    )
                )
    for prim in {stack.skeleton.prim for stack in found}:
        if (movement := moves(reading, prim)) is not None:
            reading.note(
                f"{movement[0].GetPath()}: it moves the skeleton as a whole; the robot follows turns of joints "
                "alone, and its base moves only where its own body is animated, with physics:kinematicEnabled"
            )
    return found


def performed_on(stacks: Sequence[HingeStack], stage: Usd.Stage) -> list[HingeStack]:
    """The same motors on the skeletons of another stage, which carries results. The pose that angles count from
    remains that of the stage without results."""
    skeletons = {skeleton.prim.GetPath(): skeleton for skeleton in bound_skeletons(stage)} if stacks else {}
    return [replace(stack, skeleton=skeletons[stack.skeleton.prim.GetPath()]) for stack in stacks]


def _outwards(stack: list[Drive]) -> tuple[Drive, ...]:
    """Motors in the order of their chain."""
    carried = {drive.joint.body0: drive for drive in stack}
    first = [d for d in stack if d.joint.body0 not in {other.joint.body1 for other in stack}]
    order = [first[0]] if first else []
    while order and order[-1].joint.body1 in carried and len(order) < len(stack):
        order.append(carried[order[-1].joint.body1])
    if len(order) != len(stack):
        raise ShotError(
            "the motors of one joint of a skeleton must form a chain",
            path=stack[0].joint.path,
            attribute=SKEL_JOINT,
            found=", ".join(drive.joint.path for drive in stack),
            remedy="Put each motor on the body that the previous one rotates",
        )
    return tuple(order)


def _stack(reading: Reading, skeleton: BoundSkeleton, joint: int, drives: tuple[Drive, ...]) -> HingeStack:
    place, above, path = skeleton.placement(reading.start), skeleton.parent(joint), str(skeleton.prim.GetPath())
    standing = skeleton.rest if _stands_at_rest(drives) else skeleton.locals_at(reading.start)
    parent = place if above < 0 else place @ skeleton.in_skeleton(standing)[above]
    turn, reference = (pose_from_matrix(m, path).rotation for m in (parent, standing[joint]))
    axes = [turn.T @ _axis(reading, drive) for drive in drives]
    motions = joint_motions(reading, [d.joint for d in drives], np.array([reading.start]))
    return HingeStack(skeleton, joint, drives, reference, np.array(axes), np.array([m.values[0] for m in motions]))


def _stands_at_rest(drives: tuple[Drive, ...]) -> bool:
    """Whether the authored poses of the bodies correspond to the rest pose of the skeleton."""
    poses = {str(schemas.value(drive.joint.prim, "CalmMotorAPI", SKEL_POSE)) for drive in drives}
    if len(poses) > 1 or not poses <= {"rest", "start"}:
        raise ShotError(
            "the motors of one joint of a skeleton must have the same pose, rest or start",
            path=drives[0].joint.path,
            attribute=SKEL_POSE,
            found=", ".join(sorted(poses)),
            remedy="Correct the values",
        )
    return poses == {"rest"}


def _axis(reading: Reading, drive: Drive) -> Array:
    """A motor's axis in the world, where the bodies stand."""
    joint = drive.joint
    axis = rotation_from_quaternion(joint.frame1.rotation)[:, 2]
    return reading.pose(reading.stage.GetPrimAtPath(joint.body1)).rotation @ axis


def skeletal_tracks(stack: HingeStack, clock: Clock, reading: Reading) -> dict[str, Track]:
    """Tracks of the motors of a stack, by the path of their joint; a warning where they cannot follow the skeleton."""
    codes = clock.merged(stack.skeleton.codes())
    D = stack.skeleton.local_rotations(stack.joint, codes) @ stack.reference.T
    angles, off = follow(stack.axes, D)
    _warn_of_translation(stack, codes, reading)
    worst = int(np.argmax(off))
    if off[worst] > TILT_TOLERANCE:
        names = ", ".join(drive.joint.path for drive in stack.drives)
        reading.warn(
            ShotError(
                f"{stack.skeleton.joints[stack.joint]} of {stack.skeleton.prim.GetPath()} is animated off the axes of "
                "its motors, which the motors do not allow",
                path=names,
                attribute=SKEL_JOINT,
                found=f"{np.degrees(off[worst]):.3g} degrees at time code {codes[worst]:g}",
                remedy="Animate the skeleton only about the axes of its motors, or add a motor",
            )
        )
    return {
        drive.joint.path: Track(clock.seconds(codes), start + column)
        for drive, start, column in zip(stack.drives, stack.start, angles.T, strict=True)
    }


def _warn_of_translation(stack: HingeStack, codes: Array, reading: Reading) -> None:
    """Warn where the animation moves a joint of the skeleton away from the one above it."""
    above, path = stack.skeleton.parent(stack.joint), str(stack.skeleton.prim.GetPath())
    spaces = [stack.skeleton.spaces_at(float(code)) for code in codes]
    places = np.array([space[stack.joint, :3, 3] for space in spaces])
    if above >= 0:  # from the joint above it in its axes, with all scales
        places -= [space[above, :3, 3] for space in spaces]
        turns = np.array([pose_from_matrix(space[above], path).rotation for space in spaces])
        places = np.einsum("nji,nj->ni", turns, places)
    scale = np.abs(np.linalg.det(stack.skeleton.placement(reading.start)[:3, :3])) ** (1.0 / 3.0)
    moved = reading.units.length(scale * np.linalg.norm(places - places[0], axis=1))
    worst = int(np.argmax(moved))
    if moved[worst] > GAP_TOLERANCE:
        reading.warn(
            ShotError(
                f"{stack.skeleton.joints[stack.joint]} of {stack.skeleton.prim.GetPath()} is moved away from the joint "
                "above it, which the motors do not allow",
                path=stack.drives[0].joint.path,
                attribute=SKEL_JOINT,
                found=f"{1e3 * moved[worst]:.3g} mm at time code {codes[worst]:g}",
                remedy="Animate rotations alone",
            )
        )
