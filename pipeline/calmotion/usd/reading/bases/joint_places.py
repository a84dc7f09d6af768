"""Joints whose frames do not meet at the transforms of their bodies: what is simulated is not what is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Frame
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.transforms import Pose, rotation_from_quaternion

_KINDS = ("fixed", "revolute", "prismatic", "spherical")
AWAY = 1e-2  # from each other, over the size of the robot
TURNED = 1.0  # [deg]


def tell_what_is_elsewhere(reading: Reading, joints: Sequence[JointPrim], poses: Mapping[str, Pose]) -> None:
    """Warn of the joint whose frames are farthest apart at the transforms of its bodies.

    Args:
        reading: The stage.
        joints: Of the character, those that close chains and those of several axes too.
        poses: Of the bodies, stage units.
    """
    meters = reading.units.length(1.0)
    places = np.array([pose.position for pose in poses.values()]) * meters
    anchors = [joint.frame1.position for joint in joints] + [j.frame0.position for j in joints if j.body0]
    size = max([float(np.max(np.ptp(places, axis=0))), *(float(np.linalg.norm(at)) for at in anchors)])
    found = []
    for joint in joints:
        if joint.prim is None or joint.whole is not None or joint.closes_chain or joint.kind not in _KINDS:
            continue
        away, turned = _apart(joint, poses, meters)
        if away > AWAY * size or turned > TURNED:
            found.append((away / max(size, 1e-300) + np.radians(turned), away, turned, joint))
    if not found:
        return
    _, away, turned, joint = max(found, key=lambda item: item[0])
    world = joint.body0 == ""
    reading.warn(
        ShotError(
            f"its frames do not meet where {joint.body1} is in the shot; the joint counts, not the transform",
            path=joint.path,
            attribute="physics:localPos0",
            found=f"{away:.3g} m and {turned:.3g} deg apart" + (f", and {len(found) - 1} more" if found[1:] else ""),
            remedy="Move the frame of the joint with the robot: it is in the world, which no transform above the robot "
            "moves" if world else "Correct the frames of the joint, or the transform of the body",
        )
    )  # fmt: skip


def _apart(joint: JointPrim, poses: Mapping[str, Pose], meters: float) -> tuple[float, float]:
    """Distance [m] and angle [deg] by which a joint is open where the bodies are, as far as it holds them."""
    (p, R), (q, S) = (
        _placed(frame, poses.get(body), meters)
        for frame, body in ((joint.frame0, joint.body0), (joint.frame1, joint.body1))
    )
    off = q - p
    if joint.kind == "prismatic":
        off = off - R[:, 2] * float(R[:, 2] @ off)
    if joint.kind == "spherical":
        return float(np.linalg.norm(off)), 0.0
    cosine = float(R[:, 2] @ S[:, 2]) if joint.kind == "revolute" else 0.5 * (float(np.trace(R.T @ S)) - 1.0)
    return float(np.linalg.norm(off)), float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _placed(frame: Frame, pose: Pose | None, meters: float) -> tuple[Array, Array]:
    """Position [m] and rotation of a frame in the world; pose None: of the world."""
    rotation = rotation_from_quaternion(frame.rotation)
    if pose is None:
        return frame.position, rotation
    return pose.position * meters + pose.rotation @ frame.position, pose.rotation @ rotation
