"""The gains of a motor's drive in any supported dialect."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from calmotion.model.motor import ON_ERROR, ON_JOINT, PRESCRIBED
from calmotion.usd import schemas
from calmotion.usd.dialects import GAINS, POSITION_ACTUATOR, Spelling, authored
from calmotion.usd.reading.actuators.described_motors import MODEL, SCHEMA, TYPE, DescribedMotor
from calmotion.usd.reading.actuators.foreign_actuators import affine_actuators
from calmotion.usd.reading.joints.joint_prims import JointPrim

DAMPING_ON = "calm:motor:dampingOn"
_POSITION, _VELOCITY = GAINS


@dataclass(frozen=True)
class Gains:
    """Gains of a drive, SI; zero where none are authored.

    Attributes:
        position: [N m/rad] or [N/m].
        velocity: [N m s/rad] or [N s/m].
        source: Names of the attributes that they were read from, with their dialect; empty where there are none.
        damping_on: What the velocity gain multiplies, see `Motor`.
    """

    position: float = 0.0
    velocity: float = 0.0
    source: str = ""
    damping_on: str = ON_ERROR


def read_gains(motor: DescribedMotor) -> Gains:
    """The gains that pull a joint towards the motor's command; those of the first source that has a position gain:
    Calmotion, the named motor, UsdPhysics, an actuator of MuJoCo or of Newton.

    Raises:
        ShotError: A gain that is negative or not finite, a compliant motor without a gain, or a wrong DAMPING_ON.
    """
    if motor.current is not None:
        return Gains(motor.current.position_gain, 0.0, "calm:motor:dutyGain and calm:motor:voltage (Calmotion)")
    own, *others = zip(_POSITION, _VELOCITY, strict=True)
    found = (
        _dialect_gains(motor, [own], motor.kind.get("velocity_gain", 0.0))
        or _gains_of_named(motor)
        or _dialect_gains(motor, others, 0.0)
        or _actuator_gains(motor)
        or _newton_gains(motor)
        or Gains()
    )
    if motor.model != PRESCRIBED:
        _refuse_weightless(motor, found)
    wrong = "names nothing that a velocity gain multiplies"
    damping_on = schemas.choice(motor.joint.prim, SCHEMA, DAMPING_ON, (ON_JOINT, ON_ERROR), wrong, found.damping_on)
    return replace(found, damping_on=damping_on)


def _gains_of_named(motor: DescribedMotor) -> Gains | None:
    """Those of a named motor, whose controller is taken to know the velocity of its command."""
    kind = motor.kind
    if "position_gain" not in kind.values:
        return None
    source = f"{TYPE} {kind.name} ({kind.sources['position_gain']})"
    return Gains(kind.values["position_gain"], kind.get("velocity_gain", 0.0), source)


def _dialect_gains(
    motor: DescribedMotor, dialects: Sequence[tuple[Spelling, Spelling]], damping_else: float
) -> Gains | None:
    """Gains that are authored on the joint itself; wrong ones are refused where they are used.

    Args:
        damping_else: Velocity gain where none is authored, SI.
    """
    joint = motor.joint
    for position, velocity in dialects:
        stiffness, damping = (authored(joint.prim, spelling, joint.drive) for spelling in (position, velocity))
        if stiffness is None:
            continue
        found = [item for item in (stiffness, damping) if item is not None]
        wrong = [item for item in found if not 0.0 <= item[1] < math.inf]
        if wrong and motor.model != PRESCRIBED:
            remedy = "Correct the gain, or remove the attribute"
            schemas.require(False, joint.prim, *wrong[0], "a gain must be finite and not negative", remedy)
        if wrong or not stiffness[1]:
            continue  # it pulls nowhere
        of_usd = position.dialect == "UsdPhysics"
        accelerations = of_usd and _drive_value(joint, "type") == "acceleration"
        names = " and ".join(name for name, _ in found)
        return Gains(
            position=motor.stiffness(stiffness[1]),
            velocity=damping_else if damping is None else motor.stiffness(damping[1]),
            source=f"{names} ({position.dialect}{', of accelerations' if accelerations else ''})",
            damping_on=ON_JOINT if of_usd and not _is_given_velocities(joint) else ON_ERROR,
        )
    return None


def _drive_value(joint: JointPrim, name: str) -> object:
    attribute = joint.prim.GetAttribute(f"drive:{joint.drive}:physics:{name}")
    return attribute.Get() if attribute else None


def _is_given_velocities(joint: JointPrim) -> bool:
    """Whether the UsdPhysics drive has a target velocity; its damping acts on the joint's own speed where that is 0."""
    attribute = joint.prim.GetAttribute(f"drive:{joint.drive}:physics:targetVelocity")
    return bool(attribute) and any([attribute.Get(), *map(attribute.Get, attribute.GetTimeSamples())])


def _newton_gains(motor: DescribedMotor) -> Gains | None:
    """Gains of an actuator of Newton, in radians."""
    newton = motor.newton
    if newton is None or not newton.kp > 0.0:
        return None
    source = f"newton:kp and newton:kd of {newton.path} (Newton)"
    return Gains(motor.by_radian(newton.kp), motor.by_radian(newton.kd), source, ON_JOINT)


def _actuator_gains(motor: DescribedMotor) -> Gains | None:
    """Gains of the actuators of a MuJoCo conversion that act on the joint itself; one at least holds positions."""
    acting = [actuator for actuator in affine_actuators(motor.mujoco) if actuator.slope or actuator.rate]
    if not any(actuator.holds for actuator in acting):
        return None
    stiffness = -sum(actuator.ratio**2 * actuator.slope for actuator in acting)
    damping = sum(actuator.ratio**2 * max(0.0, -actuator.rate) for actuator in acting)
    sources = [
        f"{a.prim.GetPath()}" + (f" without its damping ratio {a.rate:g}" if a.rate > 0.0 else "") for a in acting
    ]
    names = f"{POSITION_ACTUATOR[0]} and {POSITION_ACTUATOR[1]} of {' and '.join(sources)} (MuJoCo)"
    return Gains(motor.by_radian(stiffness), motor.by_radian(damping), names, ON_JOINT)


def _refuse_weightless(motor: DescribedMotor, gains: Gains) -> None:
    """Refuse gains of accelerations, and none at all, of a motor that gives."""
    drive, prim = f"drive:{motor.joint.drive}:physics", motor.joint.prim
    problem = "the gains of this drive are those of accelerations, which give no forces"
    remedy = f"Set it to force, author calm:motor:positionGain, or set {MODEL} to {PRESCRIBED}"
    schemas.require(", of accelerations" not in gains.source, prim, f"{drive}:type", "acceleration", problem, remedy)
    problem = f"a motor of the model {motor.model} needs a position gain"
    remedy = (
        f"Author it, or {drive}:stiffness, name a motor whose gain is known ({TYPE}), or set {MODEL} to {PRESCRIBED}"
    )
    schemas.require(gains.position > 0.0, prim, "calm:motor:positionGain", "none", problem, remedy)
