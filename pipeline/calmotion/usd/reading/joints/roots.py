"""Roots that the shot moves: kinematic bodies, and joints on animated prims that are not bodies."""

from collections.abc import Sequence

import numpy as np
from pxr import Usd

from calmotion.model import Frame, MovingFrame
from calmotion.usd.clock import Clock
from calmotion.usd.reading.animated import carriers, codes_of, moves
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints.chains import axis_joints
from calmotion.usd.reading.joints.joint_prims import JointPrim, read_joint
from calmotion.usd.transforms import Pose


def world_side_prim(reading: Reading, joint: JointPrim) -> Usd.Prim | None:
    """The prim that the world-side end of a joint names; None where it names none."""
    for side in (0, 1) if joint.prim is not None else ():
        relationship = joint.prim.GetRelationship(f"physics:body{side}")
        for target in relationship.GetForwardedTargets() if relationship else []:
            prim = reading.stage.GetPrimAtPath(target)
            if prim and not any(str(above.GetPath()) == joint.body1 for above in carriers(prim)):
                return prim
    return None


def on_moving_prim(reading: Reading, joint: JointPrim) -> bool:
    """Whether a joint's end in the world is on a prim that moves."""
    prim = world_side_prim(reading, joint)
    return prim is not None and moves(reading, prim) is not None


def moving_frames(
    reading: Reading, joints: Sequence[JointPrim], poses: dict[str, Pose], clock: Clock
) -> tuple[MovingFrame, ...]:
    """Motion of the world-side frames of the joints that the shot moves.

    Args:
        joints: All joints of the character, in its order.
        poses: Poses of the bodies where the joints were read, stage units.

    Raises:
        ShotError: A transform that has no rigid pose.
    """
    moving = []
    for index, joint in enumerate(joints):
        if joint.body0 != "" or joint.contact is not None:
            continue
        prim = reading.stage.GetPrimAtPath(joint.body1) if joint.prim is None else world_side_prim(reading, joint)
        if prim is None or moves(reading, prim) is None:
            continue
        shown = clock.time_codes(clock.frame_times())
        codes = np.unique(np.concatenate([shown, *(codes_of(mover) for mover in carriers(prim))]))
        frames = [world_frame(reading.at(float(code)), joint, prim, poses) for code in codes]
        rotations = np.array([frame.rotation for frame in frames])
        flips = np.where(np.sum(rotations[1:] * rotations[:-1], axis=1) < 0.0, -1.0, 1.0)
        rotations[1:] *= np.cumprod(flips)[:, None]
        moving.append(MovingFrame(index, clock.seconds(codes), np.array([f.position for f in frames]), rotations))
        if joint.kind == "floating":
            reading.note(
                f"{prim.GetPath()}: its animated transform counts at the first frame alone; contacts hold the robot"
            )
        else:
            reading.note(f"{prim.GetPath()}: its transform is animated, and moves the root of the character")
    return tuple(moving)


def world_frame(reading: Reading, joint: JointPrim, prim: Usd.Prim, poses: dict[str, Pose]) -> Frame:
    """The world-side frame of a joint at the time of a reading.

    Args:
        prim: The prim that carries the frame.
        poses: Poses of the bodies where the joints were read, stage units.
    """
    if joint.prim is None:
        return reading.pose(prim).frame(reading.units.length(1.0))
    there = read_joint(reading, joint.prim, poses)
    assert there is not None
    if joint.whole is not None:
        there = axis_joints(there, reading.units.length(1.0))[0]
    return there.frame0
