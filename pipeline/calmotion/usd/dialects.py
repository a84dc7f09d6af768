"""Attribute names of USD physics dialects, in the order of precedence.

For each quantity the first authored name counts: Calmotion, UsdPhysics, Newton, MuJoCo (`mjc:`, of the
mujoco-usd-converter), PhysX. usd-core does not define the schemas of the last three, so all are read by name.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from calmotion.errors import ShotError

if TYPE_CHECKING:
    from pxr import Usd

USD, SI = "usd", "si"  # degrees and stage units, or radians and stage units as MuJoCo has them


@dataclass(frozen=True)
class Spelling:
    """The attribute in which a dialect stores a quantity of a joint.

    Attributes:
        dialect: Name of the dialect.
        attribute: Name; `{drive}` stands for angular or linear.
    """

    dialect: str
    attribute: str


EFFORT_LIMIT = (
    Spelling("Calmotion", "calm:motor:maxTorque"),
    Spelling("UsdPhysics", "drive:{drive}:physics:maxForce"),
)
VELOCITY_LIMIT = (
    Spelling("Calmotion", "calm:motor:maxVelocity"),
    Spelling("Newton", "newton:velocityLimit"),
    Spelling("PhysX", "physxJointAxis:{drive}:maxJointVelocity"),
    Spelling("PhysX", "physxJoint:maxJointVelocity"),
    Spelling("PhysX", "physxDrivePerformanceEnvelope:{drive}:maxActuatorVelocity"),
)

# position gain and velocity gain of a drive, by dialect
GAINS = (
    (
        Spelling("Calmotion", "calm:motor:positionGain"),
        Spelling("UsdPhysics", "drive:{drive}:physics:stiffness"),
    ),
    (
        Spelling("Calmotion", "calm:motor:velocityGain"),
        Spelling("UsdPhysics", "drive:{drive}:physics:damping"),
    ),
)
# of a servo; angles of Newton are degrees, those of MuJoCo radians. PhysX' jointFriction is no torque.
ARMATURE = (
    Spelling("Calmotion", "calm:motor:armature"),
    Spelling("Newton", "newton:armature"),
    Spelling("MuJoCo", "mjc:armature"),
    Spelling("PhysX", "physxJointAxis:{drive}:armature"),
    Spelling("PhysX", "physxJoint:armature"),
)
FRICTION = (
    Spelling("Calmotion", "calm:motor:friction"),
    Spelling("Newton", "newton:friction"),
    Spelling("MuJoCo", "mjc:frictionloss"),
    Spelling("PhysX", "physxJointAxis:{drive}:dynamicFrictionEffort"),
)
VISCOUS_FRICTION = (
    Spelling("Calmotion", "calm:motor:viscousFriction"),
    Spelling("Newton", "newton:damping"),
    Spelling("MuJoCo", "mjc:damping"),
    Spelling("PhysX", "physxJointAxis:{drive}:viscousFrictionCoefficient"),
)
POSITION_ACTUATOR = ("mjc:gainPrm", "mjc:biasPrm", "mjc:gear")  # of an MjcActuator, which stands beside the joint

MIMIC_AXES = ("rotX", "rotY", "rotZ", "transX", "transY", "transZ", "X", "Y", "Z")


@dataclass(frozen=True)
class GearSpelling:
    """How a dialect describes a joint that is geared to another: value = sign (offset + ratio * leader).

    Attributes:
        leader: Name of the relationship to the joint that leads.
        offset, ratio: Names of the attributes.
        enabled: Name of the attribute that switches the gear off, or empty.
        default_ratio: Ratio where none is authored.
    """

    dialect: str
    leader: str
    offset: str
    ratio: str
    enabled: str = ""
    default_ratio: float = 1.0
    angles: str = USD
    sign: float = 1.0


GEARS = (
    GearSpelling("Newton", "newton:mimicJoint", "newton:mimicCoef0", "newton:mimicCoef1", "newton:mimicEnabled"),
    GearSpelling("MuJoCo", "mjc:target", "mjc:coef0", "mjc:coef1", angles=SI),
    # PhysX: value + gearing * leader + offset = 0
    *(
        GearSpelling(
            "PhysX", f"physxMimicJoint:{axis}:referenceJoint", f"physxMimicJoint:{axis}:offset",
            f"physxMimicJoint:{axis}:gearing", sign=-1.0,
        )
        for axis in MIMIC_AXES
    ),
)  # fmt: skip


def number_of(prim: Usd.Prim, name: str) -> float | None:
    """The value of a numeric attribute, of any numeric type; None where none is authored.

    Raises:
        ShotError: The value is not a number.
    """
    attribute = prim.GetAttribute(name)
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ShotError(
            "is not a number",
            path=prim.GetPath(),
            attribute=name,
            found=f"{value} ({attribute.GetTypeName() or 'of an unknown type'})",
            remedy="Author it as float",
        )
    return float(value)


def authored(prim: Usd.Prim, spelling: Spelling, drive: str) -> tuple[str, float] | None:
    """Name and value of an attribute where it is authored on a joint."""
    name = spelling.attribute.format(drive=drive)
    value = number_of(prim, name)
    return None if value is None else (name, value)
