"""Robots whose joints, transforms and schemas contradict each other."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from pxr import Usd

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Frame
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd.reading.context import RIGID_BODY, Reading
from calmotion.usd.reading.joints import topology
from calmotion.usd.reading.joints.joint_prims import JointPrim
from calmotion.usd.reading.joints.roots import world_side_prim
from calmotion.usd.schemas import is_applied
from calmotion.usd.transforms import Pose

_KINDS = ("fixed", "revolute", "prismatic", "spherical")
AWAY = 1e-2  # from each other, over the size of the robot
_ROUNDED = 1e-6  # likewise, over the farthest coordinate: positions of frames are single precision
TURNED = 1.0  # [deg]


def tell_what_is_elsewhere(reading: Reading, joints: Sequence[JointPrim], poses: Mapping[str, Pose]) -> None:
    """Warn of the joint whose frames are farthest apart at the transforms of its bodies.

    Args:
        joints: Of the character, those that close chains and those of several axes too.
        poses: Of the bodies, stage units.
    """
    meters = reading.units.length(1.0)
    places = np.array([pose.position for pose in poses.values()]) * meters
    anchors = [joint.frame1.position for joint in joints] + [j.frame0.position for j in joints if j.body0]
    size = max([float(np.max(np.ptp(places, axis=0))), *(float(np.linalg.norm(at)) for at in anchors)])
    far = max(float(np.abs(at).max()) for at in (places, *(joint.frame0.position for joint in joints)))
    found = []
    for joint in joints:
        if joint.prim is None or joint.whole is not None or joint.closes_chain or joint.kind not in _KINDS:
            continue
        away, turned = _apart(joint, poses, meters)
        if away > max(AWAY * size, _ROUNDED * far) or turned > TURNED:
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
            "moves"
            if world
            else "Correct the frames of the joint, or the transform of the body",
        )
    )


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


_KINEMATIC = "physics:kinematicEnabled"


def refuse_held_twice(prims: Mapping[str, Usd.Prim], joints: Sequence[JointPrim], stiff: Collection[str]) -> None:
    """Refuse a kinematic body that joints hold as well, as in animations that were exported body by body.

    Args:
        prims: Of the bodies, by path.
        stiff: Paths of the joints that leave nothing free: with motors that follow their curves exactly.
    """
    attached = {joint.body1 for joint in joints if joint.body0 == ""}
    kinematic = [path for path, prim in prims.items() if path not in attached and prim.GetAttribute(_KINEMATIC).Get()]
    if not kinematic:
        return
    rigid = [joint for joint in joints if joint.kind == "fixed" or joint.path in stiff]
    grounded = {joint.body1 for joint in rigid if joint.body0 == ""}
    group_of: dict[str, int] = {}
    held: dict[int, list[str]] = {}  # the bodies by which a group is held in the world
    for number, group in enumerate(topology.components(list(prims), rigid)):
        group_of |= dict.fromkeys(group, number)
        held[number] = [body for body in group if body in grounded or body in kinematic]
    for joint in joints:
        sides = [group_of.get(body, -1) for body in (joint.body0, joint.body1) if body]
        holders = [body for side in dict.fromkeys(sides) for body in held.get(side, [])]
        twice = len(holders) > 1 if len(set(sides)) == 1 else all(held.get(side) for side in sides)
        culprits = [body for body in holders if body in kinematic]
        if len(sides) == 2 and twice and culprits:
            _refuse(joint, culprits[-1])


def _refuse(joint: JointPrim, body: str) -> None:
    raise ShotError(
        f"the body is kinematic, so that its transform holds it, but {joint.path} and the joints before it hold it too",
        path=body,
        attribute=_KINEMATIC,
        found=True,
        remedy="Set it to false on all bodies but the root: motors, or the animated transforms of the bodies as their "
        "curves, move the others",
    )


_OF_BODIES = ("CalmFlexibleBodyAPI", "PhysicsMassAPI")


def refuse_lost_bodies(reading: Reading, bodies: list[str], joints: Sequence[JointPrim]) -> None:
    """Refuse a joint that closes a chain on such a prim; note one that carries the robot.

    Args:
        bodies: Paths of the bodies.
    """
    for joint in joints:
        prim = world_side_prim(reading, joint) if joint.body0 == "" else None
        schema = next((name for name in _OF_BODIES if prim and is_applied(prim, name)), "")
        if prim is None or not schema or is_applied(prim, RIGID_BODY):
            continue
        if joint.body1 in topology.distances(bodies, [other for other in joints if other is not joint]):
            raise ShotError(
                f"it has {schema} but is no rigid body, so that {joint.path} holds the robot in the world here",
                path=prim.GetPath(),
                attribute="apiSchemas",
                found=", ".join(map(str, prim.GetAppliedSchemas())),
                remedy=f"Apply {RIGID_BODY} where it moves; remove {schema} where it does not",
            )
        reading.note(f"{prim.GetPath()}: it has {schema} but is no rigid body, so that it stands still in the world")
