"""Joints without a motor, which swing, and animated drives that move nothing."""

from collections.abc import Collection, Sequence
from typing import Any

from calmotion.errors import ShotError
from calmotion.usd import schemas
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints import freedoms
from calmotion.usd.reading.joints.joint_prims import UNSUPPORTED, JointPrim, joint_prims
from calmotion.usd.reading.joints.topology import bridges
from calmotion.usd.reading.motors.tracks import sample_codes


def tell_what_swings(reading: Reading, joints: Sequence[JointPrim], driven: Sequence[JointPrim]) -> None:
    """Note joints that neither a motor nor a closed chain moves, where there are motors: mostly a forgotten drive.

    Args:
        joints: All of the character, those to the world included.
        driven: Those of them with a motor.
    """
    known = {id(joint) for joint in driven}
    for joint in bridges(joints) if driven else ():
        if id(joint) not in known and _swings(joint):
            said = "no motor drives this joint, so that what it carries swings; a fixed joint would hold it"
            reading.note(f"{joint.path}: {said}")


def _swings(joint: JointPrim) -> bool:
    if joint.prim is None or joint.kind in ("fixed", "floating"):
        return False
    # a drive that pulls nowhere was told where the drives are read
    return not schemas.is_applied(joint.prim, f"PhysicsDriveAPI:{joint.drive}")


def note_or_refuse_no_motors(reading: Reading, joints: Sequence[JointPrim], root: str, passive: bool) -> None:
    """Note that nothing drives a character, or refuse it: at rest it hangs, and a shot of that has no motion.

    Args:
        passive: Whether it may be without motors.

    Raises:
        ShotError: It may not, or nothing of it can move.
    """
    free = [joint for joint in joints if joint.kind != "fixed"]
    if not free:
        raise ShotError(
            "nothing of it can move: all its joints are fixed",
            path=root,
            found=", ".join(joint.path for joint in joints[:4]) or "no joint between bodies",
            remedy="Connect its parts by revolute or prismatic joints, with motors",
        )
    layer = reading.stage.GetRootLayer()
    command = f"`calmotion import {layer.GetDisplayName()} -o robot.usda`"
    if passive:
        reading.note(f"{root}: no motors: its joints move freely; {command} makes motors of them")
        return
    raise ShotError(
        "no motors: none of its joints is driven",
        path=root,
        remedy=f"{command} makes motors of its joints (--motors PATTERN: of some, --motion FILE: with a motion). In "
        "the shot itself, apply PhysicsDriveAPI:angular to the revolute joints that motors drive, and author time "
        "samples of drive:angular:physics:targetPosition, in degrees",
    )


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
                    "this joint is animated, but connects no body",
                    path=path,
                    attribute="physics:body1",
                    remedy="Name the bodies that it joins in physics:body0 and physics:body1, and apply "
                    "PhysicsRigidBodyAPI to them",
                )
        elif len(stray) == len(names) or (len(axes) > 1 and stray):
            free = ", ".join(joint.drive for joint in axes)
            raise ShotError(
                "the drive is animated in a direction in which its joint does not move",
                path=path,
                attribute=stray[0],
                found=f"a {axes[0].kind} joint" if len(axes) == 1 else f"a joint that is free in {free}",
                remedy=_remedy(axes[0], stray[0]),
            )
        elif stray:
            reading.note(f"{path}: {stray[0]} is animated and not used: the joint does not move in that direction")


def refuse_connection(path: str, attribute: Any) -> None:
    """Refuse a target position without samples that another attribute is to give.

    Raises:
        ShotError: It is connected to one, which USD does not evaluate.
    """
    if attribute.HasAuthoredConnections():
        raise ShotError(
            "its value comes by a connection, which USD does not evaluate",
            path=path,
            attribute=attribute.GetName(),
            found=", ".join(map(str, attribute.GetConnections())),
            remedy="Author time samples in its place, or remove the connection",
        )


def _remedy(joint: JointPrim, name: str) -> str:
    direction = name.split(":")[1]
    if joint.prim.GetTypeName() == freedoms.GENERIC_JOINT:
        wanted = f"Lock all directions but {direction} by PhysicsLimitAPIs (low above high)"
        return f"{wanted}, or animate {_TARGET_POSITION.format(joint.drive)}" if joint.drive else wanted
    if joint.drive:
        return f"Animate {_TARGET_POSITION.format(joint.drive)}, with PhysicsDriveAPI:{joint.drive}"
    return "Make it a PhysicsRevoluteJoint or a PhysicsPrismaticJoint, or remove the animation"
