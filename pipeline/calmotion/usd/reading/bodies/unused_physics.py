"""What a shot can say of its physics that is not simulated: velocities at the start, bodies without weight, joints that
break."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints import JointPrim

if TYPE_CHECKING:
    from pxr import Usd

_VELOCITIES = ("physics:velocity", "physics:angularVelocity")
_WEIGHTLESS = ("physxRigidBody:disableGravity", "mjc:gravcomp")  # of PhysX and of MuJoCo: gravity is taken from a body
_NEVER = 1e30  # and more stands for no limit: some programs author the largest float
_BREAKS = ("physics:breakForce", "physics:breakTorque")


def tell_what_is_not_used(reading: Reading, bodies: Iterable[Usd.Prim], joints: Sequence[JointPrim]) -> None:
    """Note attributes of the character's bodies and joints that have a value and no effect.

    Args:
        reading: The stage.
        bodies: Prims of its bodies.
        joints: Its joints.
    """
    for prim in bodies:
        for name in _VELOCITIES:
            if any(value != 0.0 for value in _authored(prim, name, reading.start)):
                reading.note(f"{prim.GetPath()}: {name} is not used: a shot starts at rest, or eases into its motion")
        for name in _WEIGHTLESS:
            if any(value != 0.0 for value in _authored(prim, name, reading.start)):
                reading.note(f"{prim.GetPath()}: {name} is not used: gravity acts on the body")
    prims = {joint.prim_path: joint.prim for joint in joints if joint.prim is not None}
    for path, prim in prims.items():
        for name in _BREAKS:
            if any(value < _NEVER for value in _authored(prim, name, reading.start)):
                reading.note(f"{path}: {name} is not used: joints do not break; the table of --csv has their reactions")
        drives = {joint.drive for joint in joints if joint.prim_path == path and joint.drive}
        for name in (f"drive:{drive}:physics:targetVelocity" for drive in sorted(drives)):
            if any(value != 0.0 for value in _authored(prim, name, reading.start)):
                reading.note(f"{path}: {name} is not used: the velocity of a motor is that of its curve")


def _authored(prim: Usd.Prim, name: str, time: float) -> tuple[float, ...]:
    """The numbers that an attribute has, none where it is not authored."""
    attribute = prim.GetAttribute(name)
    value = attribute.Get(time) if attribute and attribute.HasAuthoredValue() else None
    if value is None:
        return ()
    return tuple(float(part) for part in (value if hasattr(value, "__len__") else (value,)))
