"""The real motor that a joint names (`calm:motor:type`): its values stand for attributes that are not authored."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calmotion.catalogs.motor_types import MotorType, likely_motor_types, motor_type_named, motor_types
from calmotion.errors import ShotError
from calmotion.usd import schemas
from calmotion.usd.reading.joints.joint_prims import JointPrim

if TYPE_CHECKING:
    from pxr import Usd

TYPE = "calm:motor:type"
UNKNOWN = MotorType("", {}, {})
_KINDS = {True: "moves along an axis", False: "turns"}


def named_type(joint: JointPrim) -> MotorType:
    """The motor that the joint names; one without values where it names none.

    Raises:
        ShotError: There is no such motor, or it does not fit the joint; the user's table of motors is wrong.
    """
    name = _name(joint.prim)
    if not name:
        return UNKNOWN
    known = motor_types()
    found = motor_type_named(name, known)
    if found is None:
        raise ShotError(
            "names a motor that is not known",
            path=joint.path,
            attribute=TYPE,
            found=name,
            remedy=likely_motor_types(name, known),
        )
    if found.linear != (joint.kind == "prismatic"):
        raise ShotError(
            f"names a motor that {_KINDS[found.linear]}, but the joint {_KINDS[not found.linear]}",
            path=joint.path,
            attribute=TYPE,
            found=name,
            remedy="Name a motor that fits the joint, or remove the attribute",
        )
    return found


def _name(prim: Usd.Prim) -> str:
    return str(schemas.value(prim, "CalmMotorAPI", TYPE) or "").strip()
