"""Joints that leave several directions free, as hinges and sliders one after another.

The pose of frame 1 in frame 0 is T_x T_y T_z R_x R_y R_z of the directions that are free, as UsdPhysics and Newton have
them: each slider and hinge acts in the frame that those before it have moved. A universal joint is two hinges, a driven
ball joint three. Between them are parts that are no prims; they have the frame of the joint where they stand.
"""

from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Frame
from calmotion.support.rotations import quaternion_from_rotation, rotation_from_quaternion
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints.freedoms import SEVERAL_FREEDOMS, TRANSLATIONS
from calmotion.usd.reading.joints.joint_prims import HALF_TURN, JointPrim, axis_limits
from calmotion.usd.transforms import Pose, axis_rotation


@dataclass(frozen=True)
class Between:
    """A part between two axes of a joint.

    Attributes:
        path: A name that no prim has.
        joint: Path of the joint.
        ends: Paths of the bodies that the joint connects, without the world.
    """

    path: str
    joint: str
    ends: tuple[str, ...]


def expanded(
    reading: Reading, joints: list[JointPrim], poses: dict[str, Pose]
) -> tuple[list[JointPrim], dict[str, Between]]:
    """Joints, with hinges and sliders in place of those with several free directions.

    Args:
        joints: As read.
        poses: World poses of the bodies, stage units; those of the parts between are added.

    Returns:
        The joints, and the parts between them by path.
    """
    found: list[JointPrim] = []
    between: dict[str, Between] = {}
    for joint in joints:
        if joint.kind != SEVERAL_FREEDOMS:
            found.append(joint)
            continue
        found += axis_joints(joint, reading.units.length(1.0))
        ends = tuple(end for end in (joint.body0, joint.body1) if end)
        for path, pose in _between_poses(joint, poses, reading.units.length(1.0)).items():
            poses[path] = pose
            between[path] = Between(path, joint.path, ends)
        reading.note(
            f"{joint.path}: it is free in {', '.join(joint.free)}: hinges and sliders one after another, in this order"
        )
    return found, between


def axis_joints(joint: JointPrim, meters: float) -> list[JointPrim]:
    """The hinges and sliders of a joint, from its body 0 outwards."""
    places = [(joint.body0, joint.frame0)]
    identity = Frame(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    authored = list(joint.free)
    if joint.turned:
        # the world comes first, but the directions are those of the frame of the authored body 0
        places = [(joint.body1, joint.frame1)]
    places += [(f"{joint.path}.{name}_part", identity) for name in authored[:-1]]
    places.append((joint.body0, joint.frame0) if joint.turned else (joint.body1, joint.frame1))
    found = []
    for k, name in enumerate(authored):
        sides = [places[k], places[k + 1]]
        turn = axis_rotation(name[-1])
        if joint.turned:
            sides.reverse()
            turn = turn @ HALF_TURN
        kind = "prismatic" if name in TRANSLATIONS else "revolute"
        lower, upper = axis_limits(joint.prim, name, kind, meters)
        (body0, frame0), (body1, frame1) = sides
        found.append(
            replace(
                joint, path=f"{joint.path}.{name}", kind=kind, body0=body0, body1=body1, frame0=_turned(frame0, turn),
                frame1=_turned(frame1, turn), lower=lower, upper=upper, drive=name, whole=joint,
            )
        )  # fmt: skip
    return found[::-1] if joint.turned else found


def _turned(frame: Frame, turn: Array) -> Frame:
    return Frame(frame.position, quaternion_from_rotation(rotation_from_quaternion(frame.rotation) @ turn))


def axis_values(joint: JointPrim, R: Array, x: Array) -> tuple[Array, Array, Array]:
    """Values of the axes of a joint in given poses.

    Args:
        joint: With several free directions.
        R, x: Rotation and origin [m] of its frame 1 in its frame 0, shapes [n, 3, 3] and [n, 3].

    Returns:
        Angles [rad], unwrapped, and lengths [m] in the order of `joint.free`, shape [n, k]; what remains of the
        rotation [rad] and of the translation [m], shape [n].
    """
    if joint.turned:
        R, x = np.swapaxes(R, 1, 2), -np.einsum("nji,nj->ni", R, x)
    values = np.zeros((len(R), len(joint.free)))
    rest, gap = R, x.copy()
    for k, name in enumerate(joint.free):
        axis = "XYZ".index(name[-1])
        if name in TRANSLATIONS:
            values[:, k], gap[:, axis] = x[:, axis], 0.0
            continue
        if axis == 0 and "rotZ" in joint.free:
            angle = np.arctan2(-rest[:, 1, 2], rest[:, 2, 2])
        elif axis == 0:
            angle = np.arctan2(rest[:, 2, 1], rest[:, 1, 1])
        elif axis == 1:
            angle = np.arctan2(rest[:, 0, 2], rest[:, 2, 2])
        else:
            angle = np.arctan2(rest[:, 1, 0], rest[:, 1, 1])
        values[:, k] = angle
        rest = np.swapaxes(_about(axis, angle), 1, 2) @ rest
    cosine = 0.5 * (np.trace(rest, axis1=1, axis2=2) - 1.0)
    turning = [k for k, name in enumerate(joint.free) if name not in TRANSLATIONS]
    _continue(values, turning)
    return values, np.arccos(np.clip(cosine, -1.0, 1.0)), np.linalg.norm(gap, axis=1)


def _continue(values: Array, turning: list[int]) -> None:
    """Angles without jumps, in place: by full turns, and three of them by their other solution beyond a right angle."""
    period = 2.0 * np.pi
    for n in range(1, len(values)):
        now, before = values[n, turning], values[n - 1, turning]
        candidates = [now]
        if len(turning) == 3:
            candidates.append(np.array([now[0] + np.pi, np.pi - now[1], now[2] + np.pi]))
        near = [c - period * np.round((c - before) / period) for c in candidates]
        values[n, turning] = min(near, key=lambda c: float(np.linalg.norm(c - before)))


def _about(axis: int, angle: Array) -> Array:
    """Rotations about a coordinate axis, shape [n, 3, 3]."""
    j, k = (axis + 1) % 3, (axis + 2) % 3
    out = np.zeros((len(angle), 3, 3))
    out[:, axis, axis] = 1.0
    out[:, j, j] = out[:, k, k] = np.cos(angle)
    out[:, k, j], out[:, j, k] = np.sin(angle), -np.sin(angle)
    return out


def _between_poses(joint: JointPrim, poses: dict[str, Pose], meters: float) -> dict[str, Pose]:
    """World poses of the parts between the axes where the bodies are authored, stage units."""
    frames = []
    for body, frame in ((joint.body0, joint.frame0), (joint.body1, joint.frame1)):
        R, p = rotation_from_quaternion(frame.rotation), frame.position
        if body:
            R, p = poses[body].rotation @ R, poses[body].position * meters + poses[body].rotation @ p
        frames.append((R, p))
    (R0, p0), (R1, p1) = frames
    values = axis_values(joint, (R0.T @ R1)[None], (R0.T @ (p1 - p0))[None])[0][0]
    R, p = frames[1] if joint.turned else frames[0]
    found = {}
    for name, value in zip(joint.free[:-1], values, strict=False):
        axis = "XYZ".index(name[-1])
        if name in TRANSLATIONS:
            p = p + R[:, axis] * value
        else:
            R = R @ _about(axis, np.array([value]))[0]
        found[f"{joint.path}.{name}_part"] = Pose(R, p / meters, np.ones(3))
    return found
