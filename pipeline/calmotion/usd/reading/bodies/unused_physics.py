"""What a shot can say of its physics that is not simulated: velocities at the start, bodies without weight, joints that
break."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints import JointPrim

if TYPE_CHECKING:
    from pxr import Usd

_NEVER = 1e30  # and more stands for no limit: some programs author the largest float
_AT_REST = "a shot starts at rest, or eases into its motion"
_ALL_WEIGH = "gravity acts on the body"
_NOTHING_BRAKES = "nothing but joints brakes the body"
_NO_BREAK = "joints do not break; the table of --csv has their reactions"
_EXACT = "limits are exact"
_CURVE = "the velocity of a motor is that of its curve"
# attribute, `{drive}` being that of the joint; values that change nothing, from and to; why it is not used
OF_BODIES = (
    ("physics:velocity", 0.0, 0.0, _AT_REST),
    ("physics:angularVelocity", 0.0, 0.0, _AT_REST),
    ("physxRigidBody:disableGravity", 0.0, 0.0, _ALL_WEIGH),
    ("mjc:gravcomp", 0.0, 0.0, _ALL_WEIGH),
    ("mjc:body:gravcomp", 0.0, 0.0, _ALL_WEIGH),
    ("physxRigidBody:linearDamping", 0.0, 0.0, _NOTHING_BRAKES),
    ("physxRigidBody:angularDamping", 0.0, 0.05, _NOTHING_BRAKES),  # the fallback of PhysX
    ("physxRigidBody:lockedPosAxis", 0.0, 0.0, "a joint to the world holds a body"),
    ("physxRigidBody:lockedRotAxis", 0.0, 0.0, "a joint to the world holds a body"),
)
OF_JOINTS = (
    ("physics:breakForce", _NEVER, math.inf, _NO_BREAK),
    ("physics:breakTorque", _NEVER, math.inf, _NO_BREAK),
    ("drive:{drive}:physics:targetVelocity", 0.0, 0.0, _CURVE),
    ("physxLimit:{drive}:stiffness", 0.0, 0.0, _EXACT),
    ("physxLimit:{drive}:damping", 0.0, 0.0, _EXACT),
    ("physxDrivePerformanceEnvelope:{drive}:velocityDependentResistance", 0.0, 0.0, "viscousFriction of a servo is"),
    ("physxDrivePerformanceEnvelope:{drive}:speedEffortGradient", 0.0, 0.0, "torqueSpeedKnee of a servo is"),
    ("isaac:physics:AccelerationLimit", _NEVER, math.inf, "calm:motor:maxAcceleration is"),
    ("isaac:physics:JerkLimit", _NEVER, math.inf, "calm:motor:maxJerk is"),
)


def tell_what_is_not_used(reading: Reading, bodies: Iterable[Usd.Prim], joints: Sequence[JointPrim]) -> None:
    """Note attributes of the character's bodies and joints that have a value and no effect.

    Args:
        reading: The stage.
        bodies: Prims of its bodies.
        joints: Its joints.
    """
    for prim in bodies:
        _tell(reading, prim, "", OF_BODIES)
    told: set[tuple[str, str]] = set()
    for joint in joints:
        if joint.prim is not None and (joint.prim_path, joint.drive) not in told:
            told.add((joint.prim_path, joint.drive))
            _tell(reading, joint.prim, joint.drive, OF_JOINTS)


def _tell(reading: Reading, prim: Usd.Prim, drive: str, rows: Sequence[tuple[str, float, float, str]]) -> None:
    for attribute, low, high, why in rows:
        name = attribute.format(drive=drive)
        if any(not low <= value <= high for value in _authored(prim, name, reading.start)):
            reading.note(f"{prim.GetPath()}: {name} is not used: {why}")


def _authored(prim: Usd.Prim, name: str, time: float) -> tuple[float, ...]:
    """The numbers that an attribute has, none where it is not authored."""
    attribute = prim.GetAttribute(name)
    value = attribute.Get(time) if attribute and attribute.HasAuthoredValue() else None
    if value is None:
        return ()
    return tuple(float(part) for part in (value if hasattr(value, "__len__") else (value,)))
