"""Attribute names of USD physics dialects, in the order of precedence.

For each quantity the first authored name counts: Calmotion, UsdPhysics, Newton, MuJoCo (`mjc:`, of the
mujoco-usd-converter), PhysX. usd-core does not define the schemas of the last three, so all are read by name.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass

from pxr import Usd

from calmotion.model.motor import FRICTION_LAWS
from calmotion.usd import schemas

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
        angles, ratio_angles: Units of angles in the offset, and in a ratio between an angle and a length.
    """

    dialect: str
    leader: str
    offset: str
    ratio: str
    enabled: str = ""
    default_ratio: float = 1.0
    angles: str = USD
    ratio_angles: str = SI
    sign: float = 1.0


GEARS = (
    GearSpelling("Newton", "newton:mimicJoint", "newton:mimicCoef0", "newton:mimicCoef1", "newton:mimicEnabled"),
    GearSpelling("MuJoCo", "mjc:target", "mjc:coef0", "mjc:coef1", angles=SI),
    # PhysX: value + gearing * leader + offset = 0
    *(
        GearSpelling(
            "PhysX",
            f"physxMimicJoint:{axis}:referenceJoint",
            f"physxMimicJoint:{axis}:offset",
            f"physxMimicJoint:{axis}:gearing",
            ratio_angles=USD,
            sign=-1.0,
        )
        for axis in MIMIC_AXES
    ),
)


@dataclass(frozen=True)
class Rule:
    """What the number of an attribute may be, and what a user reads of another one."""

    allows: Callable[[float], bool]
    problem: str
    remedy: str = schemas.CORRECT


def spelled_law(field: str) -> str:
    """The attribute of a field of a law of friction."""
    return "calm:motor:friction:" + re.sub(r"_(\w)", lambda found: found[1].upper(), field)


_FINITE = Rule(math.isfinite, "is not finite", "Correct the value")
_NUMBER = Rule(lambda value: not math.isnan(value), "is not a number", "Author a number")
_POSITIVE = Rule(lambda value: 0.0 < value < math.inf, "must be positive and finite")
_POSITIVE_OR_INFINITE = Rule(lambda value: value > 0.0, "must be positive")
_NOT_NEGATIVE = Rule(lambda value: 0.0 <= value < math.inf, "must be finite and not negative")
_LIMIT = Rule(
    lambda value: value > 0.0,
    "a limit must be positive",
    "Correct the limit, or remove the attribute (the motor then has no limit)",
)
_MASS = Rule(
    lambda value: 0.0 <= value < math.inf,
    "masses and densities must be positive",
    "Author a positive value, or remove the attribute so that it follows from geometry and density",
)

RULES = {
    "physics:mass": _MASS,
    "physics:density": _MASS,
    "physics:youngsModulus": _POSITIVE,
    "physics:poissonsRatio": Rule(lambda value: -1.0 < value < 0.5, "must lie between -1 and 0.5, exclusively"),
    "calm:damping:ratio": Rule(
        lambda value: 0.0 <= value < 1.0,
        "must lie between 0 and 1 (critical damping)",
        "Author a fraction of critical damping, such as 0.01",
    ),
    "calm:damping:rayleighMass": _NOT_NEGATIVE,
    "calm:damping:rayleighStiffness": _NOT_NEGATIVE,
    "physics:lowerLimit": _NUMBER,
    "physics:upperLimit": _NUMBER,
    "limit:{drive}:physics:low": _NUMBER,
    "limit:{drive}:physics:high": _NUMBER,
    "drive:{drive}:physics:targetPosition": _FINITE,
    "drive:{drive}:physics:maxForce": _LIMIT,
    **dict.fromkeys((f"calm:motor:max{what}" for what in ("Torque", "Velocity", "Acceleration", "Jerk")), _LIMIT),
    **dict.fromkeys((f"calm:motor:{what}" for what in ("delay", "backlash", "backEmf", "gearDamping")), _NOT_NEGATIVE),
    **dict.fromkeys(
        (f"calm:motor:{what}" for what in ("gearStiffness", "frictionSpeed", "noLoadSpeed")), _POSITIVE_OR_INFINITE
    ),
    "calm:motor:torqueSpeedKnee": Rule(
        lambda value: 0.0 <= value < 1.0, "must be a share of the no-load speed, below 1"
    ),
    "calm:motor:gainFactor": _POSITIVE,
    **dict.fromkeys(
        (f"calm:motor:{what}" for what in ("voltage", "resistance", "torqueConstant", "dutyGain", "maxDuty")), _POSITIVE
    ),
    **{spelled_law(name): _NOT_NEGATIVE for law in FRICTION_LAWS for name in law.__dataclass_fields__},
    "calm:motor:friction:stribeckSpeed": _POSITIVE,
    "calm:motor:friction:stribeckExponent": _POSITIVE,
    "physics:gearRatio": Rule(
        lambda value: math.isfinite(value) and value != 0.0,
        "the ratio of a gear is a number that is not zero",
        "Author the teeth of hinge 0 over those of hinge 1, with a sign",
    ),
    "physics:ratio": Rule(
        lambda value: math.isfinite(value) and value != 0.0,
        "the ratio of a rack is a number that is not zero",
        "Author the degrees that the pinion turns while the rack moves by one unit of length",
    ),
    **dict.fromkeys((name for gear in GEARS for name in (gear.ratio, gear.offset)), _FINITE),
    **dict.fromkeys((one.attribute for one in (*ARMATURE, *FRICTION, *VISCOUS_FRICTION)), _NOT_NEGATIVE),
}


def number_of(prim: Usd.Prim, name: str, drive: str = "") -> float | None:
    """The value of a numeric attribute, of any numeric type; None where none is authored.

    Args:
        name: With `{drive}` in place of the drive, where the attribute has one.

    Raises:
        ShotError: The value is not a number, or not one that `RULES` allow.
    """
    full, rule = name.format(drive=drive), RULES.get(name)
    attribute = prim.GetAttribute(full)
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        found = f"{value} ({attribute.GetTypeName() or 'of an unknown type'})"
        schemas.require(False, prim, full, found, "is not a number", "Author it as float")
    if rule is not None:
        schemas.require(rule.allows(value), prim, full, value, rule.problem, rule.remedy)
    return float(value)


def number_or(prim: Usd.Prim, name: str, fallback: float, drive: str = "") -> float:
    """The same; the fallback where none is authored."""
    found = number_of(prim, name, drive)
    return fallback if found is None else found


def authored(prim: Usd.Prim, spelling: Spelling, drive: str) -> tuple[str, float] | None:
    """Name and value of an attribute where it is authored on a joint."""
    value = number_of(prim, spelling.attribute, drive)
    return None if value is None else (spelling.attribute.format(drive=drive), value)
