"""Animated drives that move nothing: they are refused, since their animation would be lost without a word."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from calmotion.errors import ShotError
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.generic_joints import freedoms
from calmotion.usd.reading.joints import UNSUPPORTED, JointPrim, joint_prims
from calmotion.usd.reading.motors.tracks import sample_codes

_TARGET_POSITION = "drive:{}:physics:targetPosition"


def target_positions(prim: Any) -> list[Any]:
    """The target positions of all drives of a joint's prim, as attributes."""
    applied = [name.partition(":")[2] for name in prim.GetAppliedSchemas() if name.startswith("PhysicsDriveAPI:")]
    drives = dict.fromkeys(["angular", "linear", *applied])
    return [attribute for drive in drives if (attribute := prim.GetAttribute(_TARGET_POSITION.format(drive)))]


def refuse_unused_animation(
    reading: Reading, joints: Sequence[JointPrim], driven: Collection[str], given: Collection[str]
) -> None:
    """Refuse a drive that is animated in a direction in which its joint does not move, and, where nothing is driven,
    one whose joint connects no body.

    Args:
        joints: Those that connect bodies.
        driven: Paths of those that are motors.
        given: Paths of those whose tracks are given beside the shot.

    Raises:
        ShotError: There is one.
    """
    by_path: dict[str, list[JointPrim]] = {}
    for joint in joints:
        by_path.setdefault(joint.prim_path, []).append(joint)
    for prim in joint_prims(reading.stage):
        path = str(prim.GetPath())
        animated = [attribute for attribute in target_positions(prim) if len(sample_codes(attribute))]
        axes = by_path.get(path, [])
        if not animated or path in given or any(joint.kind == UNSUPPORTED for joint in axes):
            continue
        own = [_TARGET_POSITION.format(joint.drive) for joint in axes if joint.drive]
        names = [attribute.GetName() for attribute in animated]
        stray = [name for name in names if name not in own]
        if not axes:
            if not driven:
                raise ShotError(
                    "this joint is animated, but connects no body", path=path, attribute="physics:body1",
                    remedy="Name the bodies that it joins in physics:body0 and physics:body1, and apply "
                    "PhysicsRigidBodyAPI to them",
                )  # fmt: skip
        elif len(stray) == len(names) or (len(axes) > 1 and stray):
            free = ", ".join(joint.drive for joint in axes)
            raise ShotError(
                "the drive is animated in a direction in which its joint does not move", path=path, attribute=stray[0],
                found=f"a {axes[0].kind} joint" if len(axes) == 1 else f"a joint that is free in {free}",
                remedy=_remedy(axes[0], stray[0]),
            )  # fmt: skip
        elif stray:
            reading.note(f"{path}: {stray[0]} is animated and not used: the joint does not move in that direction")


def refuse_connection(path: str, attribute: Any) -> None:
    """Refuse a target position without samples that another attribute is to give.

    Raises:
        ShotError: It is connected to one, which USD does not evaluate.
    """
    if attribute.HasAuthoredConnections():
        raise ShotError(
            "its value comes by a connection, which USD does not evaluate", path=path, attribute=attribute.GetName(),
            found=", ".join(map(str, attribute.GetConnections())),
            remedy="Author time samples in its place, or remove the connection",
        )  # fmt: skip


def _remedy(joint: JointPrim, name: str) -> str:
    direction = name.split(":")[1]
    if joint.prim.GetTypeName() == freedoms.GENERIC_JOINT:
        wanted = f"Lock all directions but {direction} by PhysicsLimitAPIs (low above high)"
        return f"{wanted}, or animate {_TARGET_POSITION.format(joint.drive)}" if joint.drive else wanted
    if joint.drive:
        return f"Animate {_TARGET_POSITION.format(joint.drive)}, with PhysicsDriveAPI:{joint.drive}"
    return "Make it a PhysicsRevoluteJoint or a PhysicsPrismaticJoint, or remove the animation"
