"""The model of a motor, and the gains of its drive in any supported dialect."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from calmotion.catalogs.motor_types import MotorType
from calmotion.errors import ShotError
from calmotion.model.motor import MODELS, ON_ERROR, ON_JOINT, PRESCRIBED, DirectCurrent
from calmotion.support.naming import nearest
from calmotion.usd import schemas
from calmotion.usd.dialects import GAINS, POSITION_ACTUATOR, Spelling, authored
from calmotion.usd.reading.actuators.foreign_actuators import NewtonActuator, affine_actuators
from calmotion.usd.reading.actuators.named_types import TYPE
from calmotion.usd.reading.joints.joint_prims import JointPrim
from calmotion.usd.units import StageUnits

if TYPE_CHECKING:
    from pxr import Usd

_SCHEMA, MODEL = "CalmMotorAPI", "calm:motor:model"
DAMPING_ON = "calm:motor:dampingOn"
AUTO = "auto"
_MODELS = (AUTO, *MODELS)
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


def motor_model(prim: Usd.Prim) -> str:
    """How the motor moves its joint: PRESCRIBED, DRIVE or SERVO.

    Raises:
        ShotError: A model that does not exist.
    """
    model = _token(prim, MODEL, _MODELS, AUTO, "names a model of motors that does not exist")
    return PRESCRIBED if model == AUTO else model


def _token(prim: Usd.Prim, name: str, allowed: Sequence[str], fallback: str, what: str) -> str:
    """The value of an attribute that has one of some names."""
    found = str(schemas.value(prim, _SCHEMA, name) or fallback)
    if found in allowed:
        return found
    raise ShotError(
        what,
        path=prim.GetPath(),
        attribute=name,
        found=found,
        remedy=f"{nearest(found, allowed)}Use one of {', '.join(allowed)}",
    )


def read_gains(
    joint: JointPrim, actuators: Sequence[Usd.Prim], newton: NewtonActuator | None, units: StageUnits, model: str,
    kind: MotorType, current: DirectCurrent | None = None,
) -> Gains:  # fmt: skip
    """The gains that pull a joint towards the motor's command; those of the first source that has a position gain:
    Calmotion, the named motor, UsdPhysics, an actuator of MuJoCo or of Newton.

    Args:
        actuators: The actuators of a MuJoCo conversion that drive the joint.
        newton: The actuator of Newton that does.
        model: Of the motor: one that gives must have gains.
        kind: The named motor; its velocity gain goes with a position gain of Calmotion's, too.
        current: The motor, where it is fed with a voltage: its gain is that of its duty cycle.

    Raises:
        ShotError: A gain that is negative or not finite, a compliant motor without a gain, or a wrong DAMPING_ON.
    """
    if current is not None:
        return Gains(current.position_gain, 0.0, "calm:motor:dutyGain and calm:motor:voltage (Calmotion)")
    used = model != PRESCRIBED
    own, *others = zip(_POSITION, _VELOCITY, strict=True)
    found = (
        _dialect_gains(joint, units, used, [own], kind.get("velocity_gain", 0.0))
        or _gains_of(kind)
        or _dialect_gains(joint, units, used, others, 0.0)
        or _actuator_gains(joint, actuators, units)
        or _newton_gains(joint, newton, units)
        or Gains()
    )
    if used:
        _refuse_weightless(joint, found, model)
    wrong = "names nothing that a velocity gain multiplies"
    return replace(found, damping_on=_token(joint.prim, DAMPING_ON, (ON_JOINT, ON_ERROR), found.damping_on, wrong))


def _gains_of(kind: MotorType) -> Gains | None:
    """Those of a named motor, whose controller is taken to know the velocity of its command."""
    if "position_gain" not in kind.values:
        return None
    source = f"{TYPE} {kind.name} ({kind.sources['position_gain']})"
    return Gains(kind.values["position_gain"], kind.get("velocity_gain", 0.0), source)


def _dialect_gains(
    joint: JointPrim, units: StageUnits, used: bool, dialects: Sequence[tuple[Spelling, Spelling]], damping_else: float
) -> Gains | None:
    """Gains that are authored on the joint itself; wrong ones are refused where they are used.

    Args:
        damping_else: Velocity gain where none is authored, SI.
    """
    to_si = _per_length(units) if joint.kind == "prismatic" else _per_degree(units)
    for position, velocity in dialects:
        stiffness, damping = (authored(joint.prim, spelling, joint.drive) for spelling in (position, velocity))
        if stiffness is None:
            continue
        found = [item for item in (stiffness, damping) if item is not None]
        for name, value in found if used else ():
            _refuse_wrong_gain(joint.prim, name, value)
        if not all(math.isfinite(value) and value >= 0.0 for _, value in found) or not stiffness[1]:
            continue  # it pulls nowhere
        values = [to_si(value) for _, value in found]
        names = " and ".join(name for name, _ in found)
        accelerations = _sets_accelerations(joint) and position.dialect == "UsdPhysics"
        kind = ", of accelerations" if accelerations else ""
        return Gains(
            position=values[0],
            velocity=values[-1] if damping is not None else damping_else,
            source=f"{names} ({position.dialect}{kind})",
            damping_on=ON_JOINT if position.dialect == "UsdPhysics" and not _is_given_velocities(joint) else ON_ERROR,
        )
    return None


def _sets_accelerations(joint: JointPrim) -> bool:
    """Whether the UsdPhysics drive's gains are those of accelerations, which depend on what it carries."""
    attribute = joint.prim.GetAttribute(f"drive:{joint.drive}:physics:type")
    return bool(attribute) and attribute.Get() == "acceleration"


def _is_given_velocities(joint: JointPrim) -> bool:
    """Whether the UsdPhysics drive has a target velocity; its damping acts on the joint's own speed where that is 0."""
    attribute = joint.prim.GetAttribute(f"drive:{joint.drive}:physics:targetVelocity")
    return bool(attribute) and any([attribute.Get(), *map(attribute.Get, attribute.GetTimeSamples())])


def _newton_gains(joint: JointPrim, newton: NewtonActuator | None, units: StageUnits) -> Gains | None:
    """Gains of an actuator of Newton, in radians."""
    if newton is None or not newton.kp > 0.0:
        return None
    to_si = _per_length(units) if joint.kind == "prismatic" else units.torque
    return Gains(to_si(newton.kp), to_si(newton.kd), f"newton:kp and newton:kd of {newton.path} (Newton)", ON_JOINT)


def _actuator_gains(joint: JointPrim, actuators: Sequence[Usd.Prim], units: StageUnits) -> Gains | None:
    """Gains of the actuators of a MuJoCo conversion that act on the joint itself; one at least holds positions."""
    acting = [actuator for actuator in affine_actuators(actuators) if actuator.slope or actuator.rate]
    if not any(actuator.holds for actuator in acting):
        return None
    stiffness = -sum(actuator.ratio**2 * actuator.slope for actuator in acting)
    damping = sum(actuator.ratio**2 * max(0.0, -actuator.rate) for actuator in acting)
    sources = [
        f"{a.prim.GetPath()}" + (f" without its damping ratio {a.rate:g}" if a.rate > 0.0 else "") for a in acting
    ]
    to_si = _per_length(units) if joint.kind == "prismatic" else units.torque
    names = f"{POSITION_ACTUATOR[0]} and {POSITION_ACTUATOR[1]} of {' and '.join(sources)} (MuJoCo)"
    return Gains(to_si(stiffness), to_si(damping), names, ON_JOINT)


def _per_degree(units: StageUnits) -> Callable[[float], float]:
    return lambda value: float(units.torque(value) / np.deg2rad(1.0))


def _per_length(units: StageUnits) -> Callable[[float], float]:
    return lambda value: float(units.force(value) / units.length(1.0))


def _refuse_wrong_gain(prim: Usd.Prim, name: str, value: float) -> None:
    if math.isfinite(value) and value >= 0.0:
        return
    raise ShotError(
        "a gain must be finite and not negative",
        path=prim.GetPath(),
        attribute=name,
        found=value,
        remedy="Correct the gain, or remove the attribute",
    )


def _refuse_weightless(joint: JointPrim, gains: Gains, model: str) -> None:
    if ", of accelerations" in gains.source:
        raise ShotError(
            "the gains of this drive are those of accelerations, which give no forces",
            path=joint.path,
            attribute=f"drive:{joint.drive}:physics:type",
            found="acceleration",
            remedy=f"Set it to force, author calm:motor:positionGain, or set {MODEL} to {PRESCRIBED}",
        )
    if not gains.position > 0.0:
        raise ShotError(
            f"a motor of the model {model} needs a position gain",
            path=joint.path,
            attribute="calm:motor:positionGain",
            found="none",
            remedy=f"Author it, or drive:{joint.drive}:physics:stiffness, name a motor whose gain is known ({TYPE}), "
            f"or set {MODEL} to {PRESCRIBED}",
        )
