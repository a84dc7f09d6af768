"""Tracks of motors from the animated transforms of their bodies."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Track
from calmotion.model.character import Frame
from calmotion.rigging.hinge_rows import about
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd import gf
from calmotion.usd.clock import Clock
from calmotion.usd.reading.animated import carriers, codes_of, has_splines, moves
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints.chains import axis_values
from calmotion.usd.reading.joints.joint_prims import JointPrim
from calmotion.usd.reading.joints.roots import world_frame, world_side_prim
from calmotion.usd.transforms import pose_from_matrix
from calmotion.usd.units import StageUnits

MOVED = 1e-6  # a relative pose that changes by more is animated [rad or m]
TILT_TOLERANCE = 1e-3  # a pose farther off the joint's axis than this is reported [rad]
GAP_TOLERANCE = 1e-4  # joint frames farther apart than this are reported [m]


@dataclass(frozen=True, eq=False)
class JointMotion:
    """How a joint moves with its bodies.

    Attributes:
        values: Angle [rad], unwrapped, or length [m], shape [n].
        tilt: How far the pose is off the joint's axis [rad], shape [n].
        gap: Distance between the two joint frames, the length of a prismatic joint excluded [m], shape [n].
    """

    values: Array
    tilt: Array
    gap: Array


def pose_codes(stage: Usd.Stage, joints: Sequence[JointPrim], clock: Clock, parts: int = 1) -> Array:
    """Time codes at which bodies of joints are posed: their samples within the shot, and its frames; empty where no
    body has any.

    Args:
        joints: Joints whose bodies are looked at.
        parts: Into which frames are divided where splines pose a body: their curvature jumps at knots, so that a cubic
            through the frames alone is another motion.
    """
    prims = {prim for path in _bodies(joints) for prim in carriers(stage.GetPrimAtPath(path))}
    found = {code for prim in prims for code in codes_of(prim)}
    if not found:
        return np.zeros(0)
    if parts > 1 and any(has_splines(prim) for prim in prims):
        frames = clock.frame_times()
        fine = np.linspace(0.0, frames[-1], parts * (len(frames) - 1) + 1)
        found.update(clock.time_codes(fine).tolist())
    return clock.merged(np.array(list(found)))


def joint_motions(reading: Reading, joints: Sequence[JointPrim], codes: Array) -> list[JointMotion]:
    """Motion of joints with the transforms of their bodies.

    The pose of a joint is F0^-1 X0^-1 X1 F1, with the bodies' rigid poses X and the joint's frames F. Of its rotation,
    the part about z is the angle, and what is left tilts.

    Args:
        reading: The stage; its first frame is where the joints were read.
        joints: Joints to evaluate.
        codes: Time codes, ascending, shape [n].
    """
    poses = _poses(reading.stage, _bodies(joints), codes, reading.units)
    found = []
    for axis in joints:
        joint = axis.whole or axis
        R1, p1 = _joint_frame(*poses[joint.body1], joint.frame1)
        if joint.body0:
            R0, p0 = _joint_frame(*poses[joint.body0], joint.frame0)
        else:
            R0, p0 = _world_frames(reading, joint, codes)
        R = np.swapaxes(R0, 1, 2) @ R1
        x = np.einsum("nji,nj->ni", R0, p1 - p0)
        if axis.whole is None:
            found.append(_about_z(R, x, joint.kind == "prismatic"))
        else:
            values, tilt, gap = axis_values(joint, R, x)
            found.append(JointMotion(values[:, joint.free.index(axis.drive)].copy(), tilt, gap))
    return found


def _bodies(joints: Sequence[JointPrim]) -> list[str]:
    """The bodies that joints connect, without the parts between the axes of one."""
    wholes = [joint.whole or joint for joint in joints]
    return sorted({end for joint in wholes for end in (joint.body0, joint.body1) if end})


def _about_z(R: Array, x: Array, slides: bool) -> JointMotion:
    turn = Rotation.from_matrix(R)
    if slides:
        return JointMotion(x[:, 2].copy(), turn.magnitude(), np.linalg.norm(x[:, :2], axis=1))
    quaternion, angle = turn.as_quat(), about(np.array([0.0, 0.0, 1.0]), turn)
    tilt = 2.0 * np.arctan2(np.linalg.norm(quaternion[:, :2], axis=1), np.linalg.norm(quaternion[:, 2:], axis=1))
    return JointMotion(angle, tilt, np.linalg.norm(x, axis=1))


def _poses(stage: Usd.Stage, paths: Sequence[str], codes: Array, units: StageUnits) -> dict[str, tuple[Array, Array]]:
    """World rotations [n, 3, 3] and origins [n, 3] [m] of bodies."""
    cache, prims = UsdGeom.XformCache(), [stage.GetPrimAtPath(path) for path in paths]
    found = {path: (np.zeros((len(codes), 3, 3)), np.zeros((len(codes), 3))) for path in paths}
    for n, code in enumerate(codes):
        cache.SetTime(float(code))
        for path, prim in zip(paths, prims, strict=True):
            pose = pose_from_matrix(gf.matrix(cache.GetLocalToWorldTransform(prim)), path)
            found[path][0][n], found[path][1][n] = pose.rotation, units.length(pose.position)
    return found


def _joint_frame(R: Array, p: Array, frame: Frame) -> tuple[Array, Array]:
    return R @ rotation_from_quaternion(frame.rotation), p + R @ frame.position


def _world_frames(reading: Reading, joint: JointPrim, codes: Array) -> tuple[Array, Array]:
    """The world-side frame of a joint, which a prim that is no body may carry."""
    prim = world_side_prim(reading, joint)
    if prim is None or moves(reading, prim) is None:
        R, p = rotation_from_quaternion(joint.frame0.rotation), joint.frame0.position
        return np.broadcast_to(R, (len(codes), 3, 3)), np.broadcast_to(p, (len(codes), 3))
    poses = {joint.body1: reading.pose(reading.stage.GetPrimAtPath(joint.body1))}
    frames = [world_frame(reading.at(float(code)), joint, prim, poses) for code in codes]
    return np.array([rotation_from_quaternion(f.rotation) for f in frames]), np.array([f.position for f in frames])


def posed_joints(reading: Reading, joints: Sequence[JointPrim], clock: Clock) -> list[str]:
    """Paths of the revolute and prismatic joints whose bodies the shot moves relative to each other."""
    able = [joint for joint in joints if joint.prim is not None and joint.kind in ("revolute", "prismatic")]
    codes = pose_codes(reading.stage, able, clock)
    if len(codes) == 0:
        return []
    driven = _animated_bodies(reading, able, codes)
    motions = joint_motions(reading, able, codes)
    return [
        joint.path
        for joint, motion in zip(able, motions, strict=True)
        if np.ptp(motion.values) > MOVED and driven.intersection(_bodies([joint]))
    ]


def _animated_bodies(reading: Reading, joints: Sequence[JointPrim], codes: Array) -> set[str]:
    """Bodies that the shot moves in the world, without kinematic roots, whose motion animates no joint."""
    poses = _poses(reading.stage, _bodies(joints), codes, reading.units)
    return {
        path
        for path, (R, p) in poses.items()
        if max(np.max(np.ptp(R, axis=0)), np.max(np.ptp(p, axis=0))) > MOVED
        and not reading.stage.GetPrimAtPath(path).GetAttribute("physics:kinematicEnabled").Get()
    }


def posed_track(motion: JointMotion, joint: JointPrim, codes: Array, clock: Clock, reading: Reading) -> Track:
    """The track of a motor; a warning where the bodies do not move as the joint allows."""
    for values, limit, what, unit, factor in (
        (motion.tilt, TILT_TOLERANCE, "off its axis", "degrees", float(np.degrees(1.0))),
        (motion.gap, GAP_TOLERANCE, "away from its joint frame", "mm", 1e3),
    ):
        worst = int(np.argmax(values))
        if values[worst] > limit:
            reading.warn(
                ShotError(
                    f"its bodies are animated {what}, which the joint does not allow",
                    path=joint.path,
                    attribute="xformOpOrder",
                    found=f"{factor * values[worst]:.3g} {unit} at time code {codes[worst]:g}",
                    remedy="Animate the bodies only as the joint allows",
                )
            )
    return Track(clock.seconds(codes), motion.values)
