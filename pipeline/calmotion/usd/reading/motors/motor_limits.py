"""Limits of a motor in any supported dialect, when it may be changed, and when it is on."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pxr import Usd

from calmotion.model import Character, FreeTrack, Motor
from calmotion.model.motor import SERVO
from calmotion.usd import schemas
from calmotion.usd.clock import Clock
from calmotion.usd.dialects import EFFORT_LIMIT, VELOCITY_LIMIT, authored, number_of
from calmotion.usd.reading.actuators.described_motors import DescribedMotor
from calmotion.usd.reading.actuators.foreign_actuators import (
    actuators_beside,
    numbers_of,
    reachable,
    token_of,
)
from calmotion.usd.reading.animated import schedule_of, switched
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints.joint_prims import JointPrim

_SCHEMA, _FREE, _POWERED = "CalmMotorAPI", "calm:motor:optimize", "calm:motor:powered"
_SAME = 1e-4  # of a range: what a conversion rounds


def effort_limit(motor: DescribedMotor) -> float:
    """Largest torque [N m] or force [N]; the lower of Calmotion's and UsdPhysics' limit, else that of another dialect.

    The limit of the named motor stands for one of Calmotion that is not authored.

    Raises:
        ShotError: A limit that is not positive.
    """
    joint, newton = motor.joint, motor.newton
    if motor.current is not None:
        return motor.current.largest_torque
    limit = motor.own_or_named("maxTorque", "max_torque", motor.effort, math.inf)
    force = authored(joint.prim, EFFORT_LIMIT[1], joint.drive)
    if force is not None:
        limit = min(limit, motor.effort(force[1]))
    if not math.isfinite(limit):
        limit = _mujoco_limit(motor)
    if not math.isfinite(limit) and newton is not None and 0.0 < newton.effort < math.inf:
        motor.notes.append(f"{joint.path}: effort limit from {newton.path} (Newton)")
        limit = motor.effort(newton.effort)
    return float(limit)


def velocity_limit(motor: DescribedMotor) -> float:
    """Largest speed [rad/s or m/s]; Calmotion's limit, else that of another dialect.

    The largest or no-load speed of the named motor stands for a limit of Calmotion that is not authored.

    Raises:
        ShotError: A limit that is not positive.
    """
    named = min(motor.kind.get("max_speed", math.inf), motor.kind.get("no_load_speed", math.inf))
    limit = motor.own_or_named("maxVelocity", "", motor.length, named)
    if math.isfinite(limit):
        return limit
    for spelling in VELOCITY_LIMIT[1:]:
        found = authored(motor.joint.prim, spelling, motor.joint.drive)
        if found is not None and found[1] < math.inf:
            if not found[1] > 0.0:
                return math.inf  # in these dialects 0 means no limit
            motor.notes.append(f"{motor.joint.path}: speed limit from {found[0]} ({spelling.dialect})")
            return motor.length(found[1])
    return math.inf


def _mujoco_limit(motor: DescribedMotor) -> float:
    """What the joint of MuJoCo lets through, and what its actuators give at most together, each times its gear. The
    narrower side of each range counts."""
    joint, actuators = motor.joint, motor.mujoco
    found = {"mjc:actuatorfrcrange": _range(joint.prim, "mjc:actuatorfrcrange")}
    if actuators:
        limits = [_limit_of(prim) for prim in actuators]
        names = " and ".join(f"{name} of {prim.GetPath()}" for prim, (name, _) in zip(actuators, limits, strict=True))
        found[names] = sum(limit for _, limit in limits)
    source = min(found, key=found.__getitem__)
    if not found[source] < math.inf:
        return math.inf
    motor.notes.append(f"{joint.path}: effort limit from {source} (MuJoCo)")
    return motor.effort(found[source])


def _limit_of(actuator: Usd.Prim) -> tuple[str, float]:
    """The attribute that limits an actuator, and the limit: the range of its forces, and that of its control where it
    is the force."""
    ratio = abs((numbers_of(actuator, "mjc:gear") or [1.0])[0])
    found = {"mjc:forceRange": ratio * _range(actuator, "mjc:forceRange")}
    if all(token_of(actuator, f"mjc:{what}Type") in ("", "fixed", "none") for what in ("gain", "bias", "dyn")):
        gain = abs((numbers_of(actuator, "mjc:gainPrm") or [1.0])[0])
        found["mjc:ctrlRange"] = ratio * gain * _range(actuator, "mjc:ctrlRange")
    name = min(found, key=found.__getitem__)
    return name, found[name]


def _range(prim: Usd.Prim, name: str) -> float:
    """The narrower side of a range of MuJoCo; infinite where nothing, or one side alone, is limited."""
    high = number_of(prim, f"{name}:max") or 0.0
    low = number_of(prim, f"{name}:min")
    low = -high if low is None else low
    limited = token_of(prim, name.replace("range", "limited").replace("Range", "Limited")) != "false"
    return min(-low, high) if limited and min(-low, high) > 0.0 else math.inf


def limits_of_commands(reading: Reading, joint: JointPrim, actuator: str) -> tuple[float, float]:
    """The limits of a joint [rad or m], narrowed to what the commands of its actuator of a MuJoCo conversion reach,
    which is told.

    Args:
        actuator: Its path, or empty.
    """
    limits = joint.lower, joint.upper
    if not actuator:
        return limits
    low, high = reachable(joint, actuators_beside(reading.stage, actuator, joint), reading.units.length(1.0))
    if not np.isfinite(low) or np.allclose([low, high], limits, rtol=0.0, atol=_SAME * (high - low)):
        return limits
    low, high = max(low, joint.lower), min(high, joint.upper)
    if not low < high or (low, high) == limits:
        return limits
    shown, unit = (1.0, "m") if joint.kind == "prismatic" else (float(np.degrees(1.0)), "deg")
    reading.note(
        f"{joint.path}: its limits are those of the commands of {actuator}, {shown * low:.4g} to "
        f"{shown * high:.4g} {unit}"
    )
    return low, high


def may_change(prim: Usd.Prim) -> bool:
    """Whether a motor may be changed at all."""
    return any(value for _, value in switched(prim, _SCHEMA, _FREE))


def free_tracks(stage: Usd.Stage, motors: Sequence[Motor], clock: Clock) -> tuple[FreeTrack, ...]:
    """When motors may be changed, of those for which the shot animates calm:motor:optimize: each sample holds until
    the next."""
    ranges = []
    for index, motor in enumerate(motors):
        free = schedule_of(stage.GetPrimAtPath(motor.prim_path), _SCHEMA, _FREE, clock)
        if free.changes:
            ranges.append(FreeTrack(free.times, free.active, index))
    return tuple(ranges)


def with_power(stage: Usd.Stage, character: Character, clock: Clock) -> Character:
    """The character with the times at which its motors are on, of those for which the shot animates calm:motor:powered:
    each sample holds until the next.

    Raises:
        ShotError: A motor that is off at the first frame, or that is switched and no servo.
    """
    motors = list(character.motors)
    for index, motor in enumerate(motors):
        prim = stage.GetPrimAtPath(motor.prim_path)
        powered = schedule_of(prim, _SCHEMA, _POWERED, clock)
        if np.all(powered.active):
            continue
        problem = "the motor is off at the first frame, where the robot rests"
        remedy = "Begin the shot while it is on; a joint that no motor ever turns needs no drive and no CalmMotorAPI"
        schemas.require(powered.holds_at(0.0), prim, _POWERED, False, problem, remedy)
        problem = "only a servo can be switched off: the joint of this motor follows its curve"
        remedy = "Set calm:motor:model to servo, with the gains of its controller, or remove calm:motor:powered"
        schemas.require(motor.model == SERVO, prim, _POWERED, motor.model, problem, remedy)
        motors[index] = replace(motor, powered=powered)
    return replace(character, motors=tuple(motors))
