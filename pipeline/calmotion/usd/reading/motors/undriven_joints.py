"""Joints without a motor: what they carry swings."""

from __future__ import annotations

from collections.abc import Sequence

from calmotion.errors import ShotError
from calmotion.usd import schemas
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.reading.topology import bridges


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
        joints: All of the character.
        root: Its path.
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
