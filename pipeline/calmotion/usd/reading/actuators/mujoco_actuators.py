"""Actuators of a MuJoCo conversion: prims MjcActuator beside the joints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from calmotion.usd.reading.joints import JointPrim

if TYPE_CHECKING:
    from pxr import Usd


def acts_on(actuator: Usd.Prim, joint: JointPrim) -> bool:
    """Whether an actuator acts on the joint itself, not on a tendon."""
    relationship = actuator.GetRelationship("mjc:target")
    return bool(relationship) and joint.prim.GetPath() in relationship.GetTargets()


def numbers_of(prim: Usd.Prim, name: str) -> list[float]:
    """The numbers of an attribute; none where it is not there."""
    attribute = prim.GetAttribute(name)
    value: Any = attribute.Get() if attribute else None
    return [] if value is None else [float(v) for v in value]
