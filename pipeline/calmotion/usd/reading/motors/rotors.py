"""What a servo has between its controller and the joint: rotor, gear, friction, limits of speed, delay."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from calmotion.errors import ShotError
from calmotion.shot.motor import PRESCRIBED, SERVO, Rotor
from calmotion.usd.dialects import ARMATURE, FRICTION, VISCOUS_FRICTION, Spelling, authored
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.units import StageUnits

if TYPE_CHECKING:
    from pxr import Usd

_NAME = "calm:motor:{}"
_CALMOTION = "Calmotion"


def read_delay(prim: Usd.Prim, model: str) -> float:
    """Delay of the motor's command [s]; none of an ideal motor.

    Raises:
        ShotError: It is negative or not finite.
    """
    return 0.0 if model == PRESCRIBED else _own(prim, "delay", 0.0)


def read_rotor(joint: JointPrim, units: StageUnits, model: str, notes: list[str]) -> Rotor:
    """The rotor of a servo, SI; that of other motors is empty.

    Raises:
        ShotError: A value out of its range.
    """
    if model != SERVO:
        return Rotor()
    prim, linear = joint.prim, joint.kind == "prismatic"
    length = units.length if linear else np.deg2rad
    force, inertia = (units.force, units.mass) if linear else (units.torque, units.inertia)

    def per_length(value: float) -> float:
        return float(force(value) / length(1.0))

    empty = Rotor()
    armature = _of_dialects(joint, ARMATURE, {_CALMOTION: inertia}, inertia, notes)
    if not armature:
        notes.append(f"{joint.path}: a servo without calm:motor:armature has a rotor without inertia")
    gear, knee = _own(prim, "gearStiffness", math.inf, positive=True), _own(prim, "torqueSpeedKnee", empty.knee)
    if not knee < 1.0:
        raise _wrong(prim, "torqueSpeedKnee", knee, "must be a share of the no-load speed below 1")
    speed = _own(prim, "frictionSpeed", math.nan, positive=True)
    viscous = {_CALMOTION: per_length, "Newton": per_length}  # MuJoCo has radians
    return Rotor(
        armature=armature,
        gear_stiffness=per_length(gear) if math.isfinite(gear) else math.inf,
        gear_damping=per_length(_own(prim, "gearDamping", 0.0)),
        viscous_friction=_of_dialects(joint, VISCOUS_FRICTION, viscous, per_length if linear else force, notes),
        friction=_of_dialects(joint, FRICTION, {}, force, notes),
        friction_speed=empty.friction_speed if math.isnan(speed) else float(length(speed)),
        no_load_speed=float(length(_own(prim, "noLoadSpeed", math.inf, positive=True))),
        knee=knee,
    )


def _own(prim: Usd.Prim, name: str, fallback: float, positive: bool = False) -> float:
    """The value of an attribute of CalmMotorAPI, in stage units."""
    found = authored(prim, Spelling(_CALMOTION, _NAME.format(name)), "")
    if found is None:
        return fallback
    value = found[1]
    if positive and not value > 0.0:
        raise _wrong(prim, name, value, "must be positive")
    if not value >= 0.0 or (math.isinf(value) and not positive):
        raise _wrong(prim, name, value, "must be finite and not negative")
    return value


def _of_dialects(
    joint: JointPrim, spellings: tuple[Spelling, ...], own_units: Mapping[str, Callable[[float], float]],
    to_si: Callable[[float], float], notes: list[str],
) -> float:  # fmt: skip
    """The value of the first dialect that has one, SI; zero where none has.

    Args:
        own_units: Conversions of the dialects that differ from `to_si`.
    """
    for spelling in spellings:
        found = authored(joint.prim, spelling, joint.drive)
        if found is None:
            continue
        name, value = found
        if not (math.isfinite(value) and value >= 0.0):
            raise _wrong(joint.prim, name, value, "must be finite and not negative")
        if spelling.dialect != _CALMOTION:
            notes.append(f"{joint.path}: its servo has {name} ({spelling.dialect})")
        return float(own_units.get(spelling.dialect, to_si)(value))
    return 0.0


def _wrong(prim: Usd.Prim, name: str, value: float, what: str) -> ShotError:
    return ShotError(
        f"a value of a servo {what}",
        path=prim.GetPath(),
        attribute=name if ":" in name else _NAME.format(name),
        found=value,
        remedy="Correct the value, or remove the attribute",
    )
