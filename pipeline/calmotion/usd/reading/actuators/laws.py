"""The law of a servo's friction, and the motor that is fed with a voltage (CalmMotorAPI)."""

from __future__ import annotations

import math
import re
from dataclasses import fields
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from calmotion.catalogs.motor_types import MotorType
from calmotion.errors import ShotError
from calmotion.model.motor import FRICTION_LAWS, Coulomb, DirectCurrent
from calmotion.support.naming import nearest
from calmotion.usd import schemas
from calmotion.usd.dialects import Spelling, authored
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.units import StageUnits

if TYPE_CHECKING:
    from pxr import Usd

_SCHEMA, _MODEL = "CalmMotorAPI", "calm:motor:frictionModel"
_REMEDY = "Correct the value, or remove the attribute"
_FACTOR = "calm:motor:gainFactor"
_VOLTAGE = "calm:motor:voltage"


def friction_law(joint: JointPrim, units: StageUnits, kind: MotorType) -> Coulomb:
    """The law of the friction of a servo's rotor; that of the named motor where none is authored.

    Raises:
        ShotError: A law that does not exist, a value out of range, or one that the law does not have.
    """
    prim, linear = joint.prim, joint.kind == "prismatic"
    known = {law.name: law for law in FRICTION_LAWS}
    name = str(schemas.value(prim, _SCHEMA, _MODEL) or kind.law or Coulomb.name)
    if name not in known:
        _refuse(
            prim, "names a friction that does not exist", _MODEL, name, f"{nearest(name, known)}Use {', '.join(known)}"
        )
    own = {_spelled(item.name): item.name for item in fields(known[name])}
    given = [p.GetName() for p in prim.GetAuthoredPropertiesInNamespace("calm:motor:friction")]
    for other in given:
        if other.startswith("calm:motor:friction:") and other not in own:
            remedy = f"Remove it, or set {_MODEL} to the friction that has it ({', '.join(known)})"
            _refuse(prim, f"the friction {name} has no such value", other, prim.GetAttribute(other).Get(), remedy)
    torque = units.force if linear else units.torque
    to_si = {
        "stribeck": torque,
        "stribeck_speed": units.length if linear else np.deg2rad,
        "motor_quadratic": lambda value: value / torque(1.0),
        "joint_quadratic": lambda value: value / torque(1.0),
    }
    values = {}
    for attribute, quantity in own.items():
        found = authored(prim, Spelling("Calmotion", attribute), "")
        if found is None:
            if quantity in kind.values:
                values[quantity] = kind.values[quantity]
            continue
        value = found[1]
        least = 0.0 if quantity not in ("stribeck_speed", "stribeck_exponent") else math.nextafter(0.0, 1.0)
        if not (math.isfinite(value) and value >= least):
            _refuse(prim, "a value of a friction must be finite and not negative", attribute, value, _REMEDY)
        values[quantity] = float(to_si[quantity](value)) if quantity in to_si else value
    law = known[name](**values)
    terms = law.terms()
    lost = terms.joint_load + terms.stribeck_joint_load
    if not lost < 1.0:
        _refuse(
            prim, "the friction takes all torque on the joint's side of the gear", _MODEL, lost,
            "Let friction:load and friction:stribeckLoad, or the jointLoad of both, have a sum below 1",
        )  # fmt: skip
    return law


def direct_current(joint: JointPrim, units: StageUnits, kind: MotorType) -> DirectCurrent | None:
    """The motor of a servo that is fed with a voltage, SI; None where no voltage is authored.

    Winding and torque constant are those of the named motor where they are not authored.

    Raises:
        ShotError: A value is missing or out of range, or a position gain is authored beside it.
    """
    prim, linear = joint.prim, joint.kind == "prismatic"
    if authored(prim, Spelling("Calmotion", _VOLTAGE), "") is None:
        return None
    if authored(prim, Spelling("Calmotion", "calm:motor:positionGain"), "") is not None:
        _refuse(
            prim, "a motor that is fed with a voltage has its gain by the duty cycle", "calm:motor:positionGain",
            "authored", f"Remove it, or {_VOLTAGE}",
        )  # fmt: skip
    torque, length = (units.force, units.length) if linear else (units.torque, np.deg2rad)

    def value(name: str, quantity: str = "", fallback: float | None = None) -> float:
        attribute = f"calm:motor:{name}"
        found = authored(prim, Spelling("Calmotion", attribute), "")
        given = kind.values.get(quantity, fallback) if found is None else found[1]
        if given is None:
            remedy = f"Author it, or remove {_VOLTAGE}"
            _refuse(prim, "a motor that is fed with a voltage needs it", attribute, "none", remedy)
        if not (math.isfinite(given) and given > 0.0):
            _refuse(prim, "must be positive and finite", attribute, given, _REMEDY)
        return float(torque(given)) if name == "torqueConstant" and found is not None else float(given)

    return DirectCurrent(
        value("voltage"), value("resistance", "resistance"), value("torqueConstant", "torque_constant"),
        value("dutyGain") / float(length(1.0)), value("maxDuty", "", 1.0),
    )  # fmt: skip


def gain_factor(prim: Usd.Prim) -> float:
    """By what a calibration found the position gain to differ; 1 where nothing is authored.

    Raises:
        ShotError: It is not positive.
    """
    found = authored(prim, Spelling("Calmotion", _FACTOR), "")
    if found is None:
        return 1.0
    if not (math.isfinite(found[1]) and found[1] > 0.0):
        _refuse(prim, "must be positive and finite", _FACTOR, found[1], _REMEDY)
    return found[1]


def _spelled(field: str) -> str:
    """The attribute of a field of a law."""
    return "calm:motor:friction:" + re.sub(r"_(\w)", lambda found: found[1].upper(), field)


def _refuse(prim: Usd.Prim, problem: str, attribute: str, found: object, remedy: str) -> NoReturn:
    raise ShotError(problem, path=prim.GetPath(), attribute=attribute, found=found, remedy=remedy)
