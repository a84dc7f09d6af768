"""Joints: their bodies, and their frames with the axis along z."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdPhysics

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import WORLD, Frame
from calmotion.model.animation import Contact
from calmotion.support.naming import nearest
from calmotion.support.rotations import quaternion_from_rotation, rotation_from_quaternion
from calmotion.usd import gf
from calmotion.usd.dialects import number_of, number_or
from calmotion.usd.reading.context import Reading, prims_of
from calmotion.usd.reading.joints import freedoms
from calmotion.usd.transforms import Pose, axis_rotation

_KINDS = {
    "PhysicsRevoluteJoint": "revolute",
    "PhysicsPrismaticJoint": "prismatic",
    "PhysicsFixedJoint": "fixed",
    "PhysicsSphericalJoint": "spherical",
}
_WITH_AXIS = ("revolute", "prismatic")
_DRIVES = {"revolute": "angular", "prismatic": "linear"}
_LIMITS = ("physics:lowerLimit", "physics:upperLimit")
UNSUPPORTED = "unsupported"
HALF_TURN = np.diag([1.0, -1.0, -1.0])  # about x: turns the z axis over


@dataclass(frozen=True, eq=False)
class JointPrim:
    """A joint as read, before bodies are numbered.

    Attributes:
        prim: The Usd.Prim, None for a joint that the reader added.
        path: Its path.
        kind: `revolute`, `prismatic`, `spherical`, `fixed` or `floating`; `freedoms.SEVERAL_FREEDOMS` before
            `chains.expanded`; or `UNSUPPORTED`, which matters only where the joint is part of the character.
        body0, body1: Paths of the bodies, empty for the world.
        frame0, frame1: Frames in them, m.
        lower, upper: Limits [rad or m].
        closes_chain: Whether the shot excludes this joint from the spanning tree (it closes a chain).
        drive: Name of the PhysicsDriveAPI that drives it: `angular`, `linear`, or the free direction of a generic
            joint; empty where nothing can.
        free: Directions that a joint of several axes leaves free.
        turned: Whether the world is authored as body 1 of such a joint.
        whole: The joint of several axes of which it is one.
        contact: When it holds, of a joint that comes and goes.
    """

    prim: Any
    path: str
    kind: str
    body0: str
    body1: str
    frame0: Frame
    frame1: Frame
    lower: float = -np.inf
    upper: float = np.inf
    closes_chain: bool = False
    drive: str = ""
    free: tuple[str, ...] = ()
    turned: bool = False
    whole: JointPrim | None = None
    contact: Contact | None = None

    @property
    def prim_path(self) -> str:
        """Path of its prim, which the axes of a joint share."""
        return self.path if self.prim is None else str(self.prim.GetPath())


def joint_prims(stage: Usd.Stage) -> list[Usd.Prim]:
    """The enabled joints of a stage, in its order."""
    enabled = []
    for prim in prims_of(stage):
        if prim.IsA(UsdPhysics.Joint) and prim.GetAttribute("physics:jointEnabled").Get() is not False:
            enabled.append(prim)
    return enabled


def read_joint(reading: Reading, prim: Usd.Prim, poses: dict[str, Pose]) -> JointPrim | None:
    """A joint of the stage.

    Args:
        poses: World pose of each body by path, stage units.

    Returns:
        The joint; None where it connects no body at all.

    Raises:
        ShotError: A body that does not exist, both ends on one body, values that are not finite.
    """
    path = str(prim.GetPath())
    ends = [_end(reading, prim, side, poses) for side in (0, 1)]
    if ends[0][0] == "" and ends[1][0] == "":
        reading.note(f"{path}: neither of its bodies is a rigid body, so it is left out")
        return None
    if ends[0][0] == ends[1][0]:
        raise ShotError(
            "both ends of the joint are on the same body",
            path=path,
            attribute="physics:body1",
            found=ends[0][0],
            remedy="Correct physics:body0 or physics:body1",
        )
    kind, limits = _KINDS.get(str(prim.GetTypeName()), UNSUPPORTED), _LIMITS
    free: tuple[str, ...] = ()
    if prim.GetTypeName() == freedoms.GENERIC_JOINT:
        found = freedoms.freedoms(prim)
        kind, drive, axis, limits, free = found.kind, found.freedom, found.axis, freedoms.LIMITS, found.free
        if not kind:
            reading.note(f"{path}: it leaves all directions free and nothing drives it, so it is left out")
            return None
        if kind != freedoms.SEVERAL_FREEDOMS:
            reading.note(f"{path}: a generic joint, {kind} by the directions that it locks")
    else:
        drive, axis = _DRIVES.get(kind, ""), _axis(prim) if kind in _WITH_AXIS else ""
    turn = axis_rotation(axis) if axis else np.eye(3)
    meters = reading.units.length(1.0)
    to_si = np.deg2rad(1.0) if kind == "revolute" else meters
    lower, upper = _limits(prim, limits, to_si, drive) if kind in _WITH_AXIS else (-np.inf, np.inf)
    low, high = (number_of(prim, name, drive) for name in limits) if kind in _WITH_AXIS else (None, None)
    if low is not None and high is not None and low > high:
        reading.note(f"{path}: its lower limit is above its upper one, so UsdPhysics does not limit it")
    (body0, position0, rotation0), (body1, position1, rotation1) = ends
    turned = body1 == ""
    if turned:
        # The world comes first. Turning the axis over keeps the sense of angle or length, so limits and track stay.
        body0, body1 = body1, body0
        position0, position1 = position1, position0
        rotation0, rotation1 = rotation1, rotation0
        turn = turn @ HALF_TURN if kind != freedoms.SEVERAL_FREEDOMS else turn
    return JointPrim(
        prim,
        path,
        kind,
        body0,
        body1,
        Frame(position0 * meters, quaternion_from_rotation(rotation0 @ turn)),
        Frame(position1 * meters, quaternion_from_rotation(rotation1 @ turn)),
        lower,
        upper,
        prim.GetAttribute("physics:excludeFromArticulation").Get() is True,
        drive,
        free if kind == freedoms.SEVERAL_FREEDOMS else (),
        turned and kind == freedoms.SEVERAL_FREEDOMS,
    )


def axis_limits(prim: Usd.Prim, direction: str, kind: str, meters: float) -> tuple[float, float]:
    """Lower and upper limit [rad or m] of a direction of a generic joint, infinite where there is none.

    Args:
        direction: `rotX`, `transZ`, ...
        kind: `revolute` or `prismatic`.
        meters: Metres in the stage's unit of length.
    """
    return _limits(prim, freedoms.LIMITS, np.deg2rad(1.0) if kind == "revolute" else meters, direction)


def joint_to_world(body: str, pose: Pose, meters: float, kind: str = "fixed") -> JointPrim:
    """A joint between the world and a body at its pose at the first frame: a fixed one, or one that leaves it free."""
    here = Frame(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    return JointPrim(None, body, kind, "", body, pose.frame(meters), here)


def _end(reading: Reading, prim: Usd.Prim, side: int, poses: dict[str, Pose]) -> tuple[str, Array, Array]:
    """One end of a joint: path of its body (empty: world), position [3] in stage units and rotation [3, 3] there."""
    name = f"physics:body{side}"
    relationship = prim.GetRelationship(name)
    named = relationship.GetForwardedTargets() if relationship else []
    if len(named) > 1:
        raise ShotError(
            "a joint end is one body",
            path=prim.GetPath(),
            attribute=name,
            found=", ".join(str(t) for t in named),
            remedy="Keep one target",
        )
    position = _finite(prim, f"physics:localPos{side}", gf.vector)
    quaternion = _finite(prim, f"physics:localRot{side}", gf.quaternion)
    if np.linalg.norm(quaternion) < 1e-6:
        raise ShotError(
            "is not a rotation",
            path=prim.GetPath(),
            attribute=f"physics:localRot{side}",
            found=quaternion.tolist(),
            remedy="Author a unit quaternion",
        )
    rotation = rotation_from_quaternion(quaternion)
    if not named:
        refuse_lost_target(relationship)
        return "", position, rotation
    target = reading.stage.GetPrimAtPath(named[0])
    if not target:
        raise ShotError(
            "names a prim that does not exist",
            path=prim.GetPath(),
            attribute=name,
            found=named[0],
            remedy=f"{nearest(str(named[0]), poses)}Correct the target, or remove the joint",
        )
    refuse_no_place(prim, name, target)
    body = target
    while body and str(body.GetPath()) not in poses:
        body = body.GetParent()
    path = str(body.GetPath()) if body else ""
    if path == str(target.GetPath()):
        # The position is in the body's own axes, which may be scaled; the rotation is not.
        return path, poses[path].scale * position, rotation
    pose = reading.pose(target)  # of a prim that is no body: carried by the body above it, or by the world
    world = pose.rotation @ (pose.scale * position) + pose.position
    if not path:
        return "", world, pose.rotation @ rotation
    return path, poses[path].to_local(world[None])[0], poses[path].rotation.T @ pose.rotation @ rotation


def _axis(prim: Usd.Prim) -> str:
    axis = prim.GetAttribute("physics:axis").Get()
    if axis not in ("X", "Y", "Z"):
        raise ShotError(
            "unknown axis", path=prim.GetPath(), attribute="physics:axis", found=axis, remedy="Use X, Y or Z"
        )
    return str(axis)


def _finite(prim: Usd.Prim, name: str, convert: Callable[[Any], Array]) -> Array:
    value = prim.GetAttribute(name).Get()
    converted = convert(value)
    if not np.all(np.isfinite(converted)):
        raise ShotError("is not finite", path=prim.GetPath(), attribute=name, found=value, remedy="Correct the value")
    return converted


def _limits(prim: Usd.Prim, names: tuple[str, str], to_si: float, direction: str = "") -> tuple[float, float]:
    """Lower and upper limit [rad or m], infinite where there is none."""
    lower, upper = (number_or(prim, name, end, direction) for name, end in zip(names, (-np.inf, np.inf), strict=True))
    if lower > upper:
        return -np.inf, np.inf  # UsdPhysics: a joint whose lower limit exceeds its upper one is not limited
    return to_si * lower, to_si * upper


def refuse_unsupported(joint: JointPrim) -> None:
    """Raise a ShotError for a joint of a kind that cannot be simulated yet."""
    if joint.kind == UNSUPPORTED:
        raise ShotError(
            "a joint of this type is not supported",
            path=joint.path,
            found=str(joint.prim.GetTypeName()),
            remedy="Use a revolute, prismatic, spherical or fixed joint, or a PhysicsJoint whose PhysicsLimitAPIs lock "
            "some directions (low above high), or disable it with physics:jointEnabled = false",
        )


def body_index(path: str, numbers: dict[str, int]) -> int:
    """The index of a body by its path, `WORLD` for the empty one."""
    return WORLD if path == "" else numbers[path]


def refuse_lost_target(relationship: Usd.Relationship) -> None:
    """Refuse a relationship whose target USD leaves out, since an arc does not reach it.

    Args:
        relationship: One without targets as composed.

    Raises:
        ShotError: A layer names a target.
    """
    for spec in relationship.GetPropertyStack() if relationship else []:
        edits = spec.targetPathList
        if edits.deletedItems:
            return  # meant
        authored = edits.explicitItems if edits.isExplicit else [*edits.prependedItems, *edits.appendedItems]
        if authored:
            raise ShotError(
                "names a prim that is outside of what is referenced, or of the instance; USD leaves it out",
                path=relationship.GetPrimPath(),
                attribute=relationship.GetName(),
                found=_named(authored, spec.layer),
                remedy="Reference a prim that holds both, or author the target in the layer of the shot",
            )
        if edits.isExplicit:
            return


def _named(targets: list[Sdf.Path], layer: Sdf.Layer) -> str:
    return f"{', '.join(map(str, targets))} in {layer.GetDisplayName()}"


def refuse_no_place(joint: Usd.Prim, name: str, target: Usd.Prim) -> None:
    """Refuse a prim that can be neither a body nor a place in the world: a joint, a material.

    Raises:
        ShotError: It is of a type that has no transform.
    """
    kind = str(target.GetTypeName())
    if kind and kind != "Scope" and not target.IsA(UsdGeom.Xformable):
        raise ShotError(
            "names a prim that is no body and has no transform",
            path=joint.GetPath(),
            attribute=name,
            found=f"{target.GetPath()} ({kind})",
            remedy="Name a body (PhysicsRigidBodyAPI), or nothing for the world",
        )
