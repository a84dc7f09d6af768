"""What a servo has between its controller and the joint: winding, rotor, gear, friction, speed, delay, backlash."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from calmotion.catalogs.motor_types import MotorType
from calmotion.errors import ShotError
from calmotion.model.motor import FRICTION_LAWS, PRESCRIBED, SERVO, Coulomb, DirectCurrent, Rotor
from calmotion.support.naming import nearest
from calmotion.usd import schemas
from calmotion.usd.dialects import ARMATURE, FRICTION, VISCOUS_FRICTION, Spelling, authored
from calmotion.usd.reading.actuators.foreign_actuators import NewtonActuator
from calmotion.usd.reading.joints.joint_prims import JointPrim
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


_NAME = "calm:motor:{}"
_CALMOTION = "Calmotion"
_COEFFICIENT = "physxJoint:jointFriction"

ToSI = Callable[[float], float]


@dataclass(frozen=True)
class _Values:
    """Values of one joint, by Calmotion's attributes and the named motor."""

    joint: JointPrim
    kind: MotorType
    notes: list[str]

    def own(self, name: str, quantity: str, to_si: ToSI, fallback: float, positive: bool = False) -> float:
        """The value of an attribute of CalmMotorAPI, SI."""
        found = _own(self.joint.prim, name, positive)
        return self.kind.get(quantity, fallback) if found is None else float(to_si(found))

    def of_dialects(
        self, spellings: tuple[Spelling, ...], quantity: str, own_units: Mapping[str, ToSI], to_si: ToSI
    ) -> float:
        """The value of the first dialect that has one, SI; zero where none has.

        Args:
            own_units: Conversions of the dialects that differ from `to_si`.
        """
        for spelling in spellings:
            if spelling.dialect != _CALMOTION and quantity in self.kind.values:
                break
            found = authored(self.joint.prim, spelling, self.joint.drive)
            if found is None:
                continue
            name, value = found
            if not (math.isfinite(value) and value >= 0.0):
                raise _wrong(self.joint.prim, name, value, "must be finite and not negative")
            if spelling.dialect != _CALMOTION:
                self.notes.append(f"{self.joint.path}: its servo has {name} ({spelling.dialect})")
            return float(own_units.get(spelling.dialect, to_si)(value))
        return self.kind.get(quantity, 0.0)


def read_delay(joint: JointPrim, model: str, kind: MotorType, newton: NewtonActuator | None) -> float:
    """Delay of the motor's command [s]; an ideal motor does not use it.

    Raises:
        ShotError: It is negative or not finite, and used.
    """
    try:
        own = _own(joint.prim, "delay", False)
    except ShotError:
        if model != PRESCRIBED:
            raise
        own = 0.0
    other = newton.delay if newton is not None else 0.0
    return kind.get("delay", other) if own is None else own


def read_backlash(joint: JointPrim, units: StageUnits, kind: MotorType) -> float:
    """Play between the motor and the joint, from one end to the other [rad] or [m].

    Raises:
        ShotError: It is negative or not finite.
    """
    found = _own(joint.prim, "backlash", False)
    length = units.length if joint.kind == "prismatic" else np.deg2rad
    return kind.get("backlash", 0.0) if found is None else float(length(found))


def read_rotor(
    joint: JointPrim, units: StageUnits, model: str, kind: MotorType, newton: NewtonActuator | None, notes: list[str],
    current: DirectCurrent | None = None,
) -> Rotor:  # fmt: skip
    """The rotor of a servo, SI; of an ideal motor the one that it would have as a servo, and of a drive an empty one.

    Args:
        current: The motor, where it is fed with a voltage.

    Raises:
        ShotError: A value out of its range, of a servo or a motor whose type is named.
    """
    if model == SERVO or kind.values:
        return _with_back_emf(_rotor(joint, units, model, kind, newton, notes), joint, units, kind, current)
    try:
        found = _rotor(joint, units, model, kind, newton, [])
    except ShotError:
        return Rotor()  # it is not used
    if model == PRESCRIBED:
        return found
    if found != Rotor():
        notes.append(
            f"{joint.path}: a drive is simulated without the rotor inertia, friction and limits of speed that the file "
            f"has; calm:motor:model = {SERVO} has them"
        )
    return Rotor()


def _with_back_emf(
    rotor: Rotor, joint: JointPrim, units: StageUnits, kind: MotorType, current: DirectCurrent | None
) -> Rotor:
    """The rotor with its back-EMF, which is a part of the viscous friction of a named motor, and of one that is
    authored where no voltage and no back-EMF are."""
    linear = joint.kind == "prismatic"
    unit = units.force(1.0) / units.length(1.0) if linear else units.torque(1.0) / np.deg2rad(1.0)
    authored_emf = _own(joint.prim, "backEmf", False)
    induced = 0.0
    if "resistance" in kind.values and _own(joint.prim, "viscousFriction", False) is None:
        induced = min(kind.values["torque_constant"] ** 2 / kind.values["resistance"], rotor.viscous_friction)
        rotor = replace(rotor, viscous_friction=rotor.viscous_friction - induced)
    if current is not None:
        induced = current.back_emf
    return replace(rotor, back_emf=induced if authored_emf is None else float(unit * authored_emf))


def _rotor(
    joint: JointPrim, units: StageUnits, model: str, kind: MotorType, newton: NewtonActuator | None, notes: list[str]
) -> Rotor:
    prim, linear = joint.prim, joint.kind == "prismatic"
    length = units.length if linear else np.deg2rad
    force, inertia = (units.force, units.mass) if linear else (units.torque, units.inertia)
    at, empty = _Values(joint, kind, notes), Rotor()

    def per_length(value: float) -> float:
        return float(force(value) / length(1.0)) if math.isfinite(value) else math.inf

    def same(value: float) -> float:
        return value

    armature = at.of_dialects(ARMATURE, "armature", {_CALMOTION: inertia}, inertia)
    if not armature and model == SERVO:
        notes.append(f"{joint.path}: a servo without calm:motor:armature has a rotor without inertia")
    speed, knee = empty.no_load_speed, empty.knee
    if newton is not None:
        speed, knee = float(units.length(newton.velocity) if linear else newton.velocity), newton.knee
        notes.extend(f"{joint.path}: {what} of {newton.path} is not simulated" for what in newton.unread)
    knee = at.own("torqueSpeedKnee", "torque_speed_knee", same, knee)
    if not knee < 1.0:
        raise _wrong(prim, "torqueSpeedKnee", knee, "must be a share of the no-load speed below 1")
    found = authored(prim, Spelling("PhysX", _COEFFICIENT), joint.drive)
    friction = at.of_dialects(FRICTION, "friction", {}, force)
    if found is not None and found[1] and not friction:
        notes.append(f"{joint.path}: {_COEFFICIENT} is a coefficient, not a torque: author {_name('friction')} instead")
    viscous = dict.fromkeys((_CALMOTION, "Newton", "PhysX"), per_length)  # MuJoCo has radians
    return Rotor(
        armature=armature,
        gear_stiffness=at.own("gearStiffness", "gear_stiffness", per_length, math.inf, positive=True),
        gear_damping=at.own("gearDamping", "gear_damping", per_length, 0.0),
        viscous_friction=at.of_dialects(
            VISCOUS_FRICTION, "viscous_friction", viscous, per_length if linear else force
        ),
        friction=friction,
        friction_speed=at.own("frictionSpeed", "friction_speed", length, empty.friction_speed, positive=True),
        no_load_speed=at.own("noLoadSpeed", "no_load_speed", length, speed, positive=True),
        knee=knee,
        law=friction_law(joint, units, kind),
    )  # fmt: skip


def _name(name: str) -> str:
    return _NAME.format(name)


def _own(prim: Usd.Prim, name: str, positive: bool) -> float | None:
    """The value of an attribute of CalmMotorAPI, in stage units; None where none is authored."""
    found = authored(prim, Spelling(_CALMOTION, _name(name)), "")
    if found is None:
        return None
    value = found[1]
    if positive and not value > 0.0:
        raise _wrong(prim, name, value, "must be positive")
    if not value >= 0.0 or (math.isinf(value) and not positive):
        raise _wrong(prim, name, value, "must be finite and not negative")
    return value


def _wrong(prim: Usd.Prim, name: str, value: float, what: str) -> ShotError:
    return ShotError(
        f"a value of a servo {what}",
        path=prim.GetPath(),
        attribute=name if ":" in name else _name(name),
        found=value,
        remedy="Correct the value, or remove the attribute",
    )
