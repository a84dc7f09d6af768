"""Kinematic bodies in the middle of a robot: their transforms hold them, and its joints do as well."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING

from calmotion.errors import ShotError
from calmotion.usd.reading import topology
from calmotion.usd.reading.joints import JointPrim

if TYPE_CHECKING:
    from pxr import Usd

_KINEMATIC = "physics:kinematicEnabled"


def refuse_held_twice(prims: Mapping[str, Usd.Prim], joints: Sequence[JointPrim], stiff: Collection[str]) -> None:
    """Refuse a kinematic body that joints hold as well, as in animations that were exported body by body.

    Args:
        prims: Of the bodies, by path.
        joints: Of the robot.
        stiff: Paths of the joints that leave nothing free: with motors that follow their curves exactly.

    Raises:
        ShotError: There is one.
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
