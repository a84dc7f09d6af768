"""Limits of a motor in any supported dialect."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from calmotion.errors import ShotError
from calmotion.rigging.motor_types import MotorType
from calmotion.usd import schemas
from calmotion.usd.dialects import EFFORT_LIMIT, VELOCITY_LIMIT, Spelling, authored, first_finite, number_of
from calmotion.usd.reading.actuators.mujoco_actuators import acts_on, numbers_of
from calmotion.usd.reading.actuators.newton_actuators import NewtonActuator
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.units import StageUnits

if TYPE_CHECKING:
    from pxr import Usd

_SCHEMA = "CalmMotorAPI"


def effort_limit(
    joint: JointPrim, units: StageUnits, notes: list[str], kind: MotorType, newton: NewtonActuator | None,
    mujoco: Usd.Prim | None,
) -> float:  # fmt: skip
    """Largest torque [N m] or force [N]; the lower of Calmotion's and UsdPhysics' limit, else that of another dialect.

    Args:
        kind: The named motor, whose limit stands for one of Calmotion that is not authored.
        newton, mujoco: The joint's actuator, of one or the other.

    Raises:
        ShotError: A limit that is not positive.
    """
    to_si = units.force if joint.kind == "prismatic" else units.torque
    own = authored(joint.prim, EFFORT_LIMIT[0], joint.drive)
    limit = kind.get("max_torque", math.inf) if own is None else to_si(positive(joint.prim, *own))
    force = authored(joint.prim, EFFORT_LIMIT[1], joint.drive)
    if force is not None:
        limit = min(limit, to_si(positive(joint.prim, *force)))
    if not math.isfinite(limit):
        limit = min(_dialect_limit(joint, EFFORT_LIMIT[2:], to_si, notes), _actuator_limit(joint, mujoco, to_si, notes))
    if not math.isfinite(limit) and newton is not None and 0.0 < newton.effort < math.inf:
        notes.append(f"{joint.path}: its limit is taken from {newton.path} (Newton)")
        limit = to_si(newton.effort)
    return float(limit)


def velocity_limit(joint: JointPrim, units: StageUnits, notes: list[str], kind: MotorType) -> float:
    """Largest speed [rad/s or m/s]; Calmotion's limit, else that of another dialect.

    Args:
        kind: The named motor, whose largest or no-load speed stands for a limit of Calmotion that is not authored.

    Raises:
        ShotError: A limit that is not positive.
    """
    to_si = units.length if joint.kind == "prismatic" else np.deg2rad
    own = authored(joint.prim, VELOCITY_LIMIT[0], joint.drive)
    named = min(kind.get("max_speed", math.inf), kind.get("no_load_speed", math.inf))
    limit = named if own is None else to_si(positive(joint.prim, *own))
    return float(limit if math.isfinite(limit) else _dialect_limit(joint, VELOCITY_LIMIT[1:], to_si, notes))


def _dialect_limit(
    joint: JointPrim, spellings: tuple[Spelling, ...], to_si: Callable[[float], float], notes: list[str]
) -> float:
    found = first_finite(joint.prim, spellings, joint.drive)
    if found is None:
        return math.inf
    name, value, spelling = found
    if not value > 0.0:
        return math.inf  # in these dialects 0 means no limit
    notes.append(f"{joint.path}: its limit is taken from {name} ({spelling.dialect})")
    return float(to_si(value))


def _actuator_limit(
    joint: JointPrim, actuator: Usd.Prim | None, to_si: Callable[[float], float], notes: list[str]
) -> float:
    """What an actuator of MuJoCo gives a joint at most: its range of forces, the narrower side, times its gear."""
    if actuator is None or not acts_on(actuator, joint):
        return math.inf
    low, high = (number_of(actuator, f"mjc:forceRange:{end}") or 0.0 for end in ("min", "max"))
    ratio = abs((numbers_of(actuator, "mjc:gear") or [1.0])[0])
    limit = ratio * min(-low, high)
    if str(actuator.GetAttribute("mjc:forceLimited").Get()) == "false" or not 0.0 < limit < math.inf:
        return math.inf
    notes.append(f"{joint.path}: its limit is taken from mjc:forceRange of {actuator.GetPath()} (MuJoCo)")
    return float(to_si(limit))


def calmotion_limit(prim: Usd.Prim, name: str) -> float:
    """A limit of CalmMotorAPI in stage units; infinite where there is none."""
    return positive(prim, name, schemas.value(prim, _SCHEMA, name))


def positive(prim: Usd.Prim, name: str, value: float | None) -> float:
    """The value of a limit; raises a ShotError unless it is positive."""
    if value is None or not value > 0.0:
        raise ShotError(
            "a limit must be positive",
            path=prim.GetPath(),
            attribute=name,
            found=value,
            remedy="Correct the limit, or remove the attribute (the motor then has no limit)",
        )
    return float(value)
