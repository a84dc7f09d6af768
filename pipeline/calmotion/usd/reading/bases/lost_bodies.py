"""Prims that look like bodies of the robot and have lost the schema that makes them one, so that they are the world."""

from __future__ import annotations

from collections.abc import Sequence

from calmotion.errors import ShotError
from calmotion.usd.reading import topology
from calmotion.usd.reading.bases.roots import world_side_prim
from calmotion.usd.reading.context import RIGID_BODY, Reading
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.schemas import is_applied

_OF_BODIES = ("CalmFlexibleBodyAPI", "PhysicsMassAPI")


def refuse_lost_bodies(reading: Reading, bodies: list[str], joints: Sequence[JointPrim]) -> None:
    """Refuse a joint that closes a chain on such a prim; note one that carries the robot.

    Args:
        reading: The stage.
        bodies: Paths of the bodies.
        joints: Of the robot.

    Raises:
        ShotError: There is one.
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
