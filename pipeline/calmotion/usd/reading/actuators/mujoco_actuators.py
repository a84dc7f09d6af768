"""Actuators of a MuJoCo conversion: prims MjcActuator beside the joints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from calmotion.usd.reading.joints import JointPrim

if TYPE_CHECKING:
    from pxr import Usd


def actuators_beside(stage: Usd.Stage, path: str, joint: JointPrim) -> tuple[Usd.Prim, ...]:
    """The actuators that act on the joint itself, not on a tendon: their forces add up.

    Args:
        path: Of one of them; the others are beside it.
    """
    prim = stage.GetPrimAtPath(path)
    return tuple(other for other in prim.GetParent().GetChildren() if _acts_on(other, joint)) if prim else ()


def _acts_on(actuator: Usd.Prim, joint: JointPrim) -> bool:
    relationship = actuator.GetRelationship("mjc:target")
    known = actuator.GetTypeName() == "MjcActuator" and bool(relationship)
    return known and joint.prim.GetPath() in relationship.GetTargets()


def numbers_of(prim: Usd.Prim, name: str) -> list[float]:
    """The numbers of an attribute; none where it is not there."""
    attribute = prim.GetAttribute(name)
    value: Any = attribute.Get() if attribute else None
    return [] if value is None else [float(v) for v in value]
