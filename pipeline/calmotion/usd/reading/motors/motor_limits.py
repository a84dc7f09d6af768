"""Limits of a motor, in whichever dialect they are authored."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from calmotion.errors import ShotError
from calmotion.usd import schemas
from calmotion.usd.dialects import EFFORT_LIMIT, VELOCITY_LIMIT, Spelling, authored, elsewhere
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.units import StageUnits

if TYPE_CHECKING:
    from pxr import Usd

_SCHEMA = "CalmMotorAPI"


def effort_limit(joint: JointPrim, drive: str, units: StageUnits, notes: list[str]) -> float:
    """Largest torque [N m] or force [N]; the lower of ours and that of UsdPhysics, else what another dialect says.

    Raises:
        ShotError: A limit that is not positive.
    """
    to_si = units.force if joint.kind == "prismatic" else units.torque
    limit = to_si(own_limit(joint.prim, "calm:motor:maxTorque"))
    force = authored(joint.prim, EFFORT_LIMIT[1], drive)
    if force is not None:
        limit = min(limit, to_si(positive(joint.prim, *force)))
    return float(limit if math.isfinite(limit) else _of_others(joint, EFFORT_LIMIT[2:], drive, to_si, notes))


def velocity_limit(joint: JointPrim, drive: str, units: StageUnits, notes: list[str]) -> float:
    """Largest speed [rad/s or m/s]; ours, else what another dialect says.

    Raises:
        ShotError: A limit that is not positive.
    """
    to_si = units.length if joint.kind == "prismatic" else np.deg2rad
    limit = to_si(own_limit(joint.prim, "calm:motor:maxVelocity"))
    return float(limit if math.isfinite(limit) else _of_others(joint, VELOCITY_LIMIT[1:], drive, to_si, notes))


def _of_others(
    joint: JointPrim, spellings: tuple[Spelling, ...], drive: str, to_si: Callable[[float], float], notes: list[str]
) -> float:
    found = elsewhere(joint.prim, spellings, drive)
    if found is None:
        return math.inf
    name, value, spelling = found
    if not value > 0.0:
        return math.inf  # 0 is how these dialects say that there is no limit
    notes.append(f"{joint.path}: its limit is taken from {name} ({spelling.dialect})")
    return float(to_si(value))


def own_limit(prim: Usd.Prim, name: str) -> float:
    """A limit of ours in stage units; infinite where there is none."""
    return positive(prim, name, schemas.value(prim, _SCHEMA, name))


def positive(prim: Usd.Prim, name: str, value: float | None) -> float:
    """A limit as it was found, which must be positive."""
    if value is None or not value > 0.0:
        raise ShotError(
            "a limit must be positive",
            path=prim.GetPath(),
            attribute=name,
            found=value,
            remedy="Correct the limit, or remove the attribute (then there is none)",
        )
    return float(value)
