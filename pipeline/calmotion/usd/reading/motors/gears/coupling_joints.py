"""What joints of PhysX that couple two others have in common: a gear, and a rack with its pinion.

usd-core does not know their types, so that their attributes have no fallbacks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from calmotion.errors import ShotError
from calmotion.support.naming import nearest
from calmotion.usd.dialects import number_of
from calmotion.usd.reading.context import prims_of
from calmotion.usd.reading.joints import JointPrim

if TYPE_CHECKING:
    from pxr import Usd

GEAR, RACK = "PhysxPhysicsGearJoint", "PhysxPhysicsRackAndPinionJoint"
# the joints that a prim of each type couples; the first leads where both are driven
COUPLED = {GEAR: ("physics:hinge0", "physics:hinge1"), RACK: ("physics:hinge", "physics:prismatic")}


@dataclass(frozen=True)
class Coupling:
    """q_1 = ratio q_0 of two joints, by their paths; q counts from the pose in which their bodies stand, SI."""

    prim: Any
    joints: tuple[str, str]
    ratio: float


def coupling_prims(stage: Usd.Stage) -> list[Usd.Prim]:
    """Those of a stage that are enabled."""
    return [
        prim
        for prim in prims_of(stage)
        if prim.GetTypeName() in COUPLED and prim.GetAttribute("physics:jointEnabled").Get() is not False
    ]


def coupled(prim: Usd.Prim, attribute: str) -> str:
    """Path of the joint that a coupling names; empty where it does not name one."""
    relationship = prim.GetRelationship(attribute)
    targets = relationship.GetForwardedTargets() if relationship else []
    return str(targets[0]) if len(targets) == 1 else ""


def coupled_joint(
    prim: Usd.Prim, attribute: str, among: Mapping[str, JointPrim], other: str, what: str, kind: str
) -> JointPrim:  # fmt: skip
    """The joint that a coupling names.

    Args:
        prim: The coupling.
        attribute: The relationship that names the joint.
        among: Joints of the right kind, by path.
        other: Path of the other coupled joint, empty where it is not known yet.
        what: What couples what, for the message.
        kind: Type of the joint, for the message.

    Raises:
        ShotError: None of them, several, or the other one.
    """
    path = coupled(prim, attribute)
    if path in among and path != other:
        return among[path]
    relationship = prim.GetRelationship(attribute)
    targets = [str(target) for target in relationship.GetForwardedTargets()] if relationship else []
    near = nearest(targets[0], among) if targets else ""
    both = " and ".join(COUPLED[str(prim.GetTypeName())])
    raise ShotError(
        what, path=str(prim.GetPath()), attribute=attribute, found=", ".join(targets) or None,
        remedy=f"{near}Name a {kind} of the robot, another joint in each of {both}",
    )  # fmt: skip


def ratio_of(prim: Usd.Prim, attribute: str, what: str, remedy: str) -> float:
    """The ratio of a coupling as authored, 1 where it is not.

    Raises:
        ShotError: Zero, or not a finite number.
    """
    ratio = number_of(prim, attribute)
    ratio = 1.0 if ratio is None else ratio
    if not math.isfinite(ratio) or ratio == 0.0:
        raise ShotError(what, path=str(prim.GetPath()), attribute=attribute, found=ratio, remedy=remedy)
    return ratio
