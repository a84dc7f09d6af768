"""What a shot says of the motor of one joint: its model, the real motor that it names, and actuators beside it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from pxr import Usd

from calmotion.catalogs.motor_types import MotorType, likely_motor_types, motor_type_named, motor_types
from calmotion.errors import ShotError
from calmotion.model.motor import MODELS, PRESCRIBED, SERVO, DirectCurrent
from calmotion.usd import schemas
from calmotion.usd.dialects import Spelling, authored, number_of
from calmotion.usd.reading.actuators.foreign_actuators import NewtonActuator, actuators_beside, newton_actuator
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints.joint_prims import JointPrim
from calmotion.usd.units import StageUnits

TYPE, MODEL, VOLTAGE = "calm:motor:type", "calm:motor:model", "calm:motor:voltage"
SCHEMA, AUTO = "CalmMotorAPI", "auto"
CALMOTION = "Calmotion"
UNKNOWN = MotorType("", {}, {})
_KINDS = {True: "moves along an axis", False: "turns"}

ToSI = Callable[[float], float]


@dataclass(frozen=True, eq=False)
class DescribedMotor:
    """The motor of one joint as the shot describes it.

    Attributes:
        joint: The joint.
        units: Of the stage.
        notes: Sentences for the user are appended.
        model: PRESCRIBED, DRIVE or SERVO.
        kind: The real motor that it names; one without values where it names none.
        newton: The actuator of Newton that drives it.
        mujoco: The actuators of a MuJoCo conversion that act on the joint itself.
    """

    joint: JointPrim
    units: StageUnits
    notes: list[str]
    model: str
    kind: MotorType
    newton: NewtonActuator | None
    mujoco: tuple[Any, ...]

    @property
    def linear(self) -> bool:
        """Whether it moves along an axis."""
        return self.joint.kind == "prismatic"

    def length(self, value: float) -> float:
        """A way in the stage's unit, or in degrees, in m or rad."""
        return self.units.length(value) if self.linear else float(np.deg2rad(value))

    def effort(self, value: float) -> float:
        """A force or torque of the stage in N or N m."""
        return self.units.force(value) if self.linear else self.units.torque(value)

    def stiffness(self, value: float) -> float:
        """An effort of the stage by its way in N/m or N m/rad; infinite ones stay so."""
        return self.effort(value) / self.length(1.0) if math.isfinite(value) else math.inf

    def by_radian(self, value: float) -> float:
        """An effort by the stage's unit of length, or by radian as MuJoCo and Newton have it, in N/m or N m/rad."""
        return self.stiffness(value) if self.linear else self.effort(value)

    def own(self, name: str) -> float | None:
        """The value of an attribute of CalmMotorAPI, stage units; None where none is authored."""
        return number_of(self.joint.prim, f"calm:motor:{name}")

    def own_or_named(self, name: str, quantity: str, to_si: ToSI, fallback: float) -> float:
        """The value of an attribute of CalmMotorAPI, else that of the named motor, SI."""
        found = self.own(name)
        return self.kind.get(quantity, fallback) if found is None else float(to_si(found))

    def of_dialects(
        self, spellings: tuple[Spelling, ...], quantity: str, to_si: ToSI, others: Mapping[str, ToSI] | None = None
    ) -> float:
        """The value of the first dialect that has one, SI; zero where none has.

        Args:
            others: Conversions of the dialects that differ from `to_si`.
        """
        for spelling in spellings:
            if spelling.dialect != CALMOTION and quantity in self.kind.values:
                break
            found = authored(self.joint.prim, spelling, self.joint.drive)
            if found is not None:
                if spelling.dialect != CALMOTION:
                    self.notes.append(f"{self.joint.path}: its servo has {found[0]} ({spelling.dialect})")
                return float((others or {}).get(spelling.dialect, to_si)(found[1]))
        return self.kind.get(quantity, 0.0)

    @cached_property
    def current(self) -> DirectCurrent | None:
        """The motor of a servo that is fed with a voltage, SI; None for any other.

        Winding and torque constant are those of the named motor where they are not authored.

        Raises:
            ShotError: A value is missing, or a position gain is authored beside it.
        """
        if self.model != SERVO or self.own("voltage") is None:
            return None
        prim, problem = self.joint.prim, "a motor that is fed with a voltage has its gain by the duty cycle"
        remedy = f"Remove it, or {VOLTAGE}"
        schemas.require(self.own("positionGain") is None, prim, "calm:motor:positionGain", "authored", problem, remedy)

        def value(name: str, quantity: str = "", to_si: ToSI = float, fallback: float = math.nan) -> float:
            found = self.own_or_named(name, quantity, to_si, fallback)
            problem, remedy = "a motor that is fed with a voltage needs it", f"Author it, or remove {VOLTAGE}"
            schemas.require(not math.isnan(found), prim, f"calm:motor:{name}", "none", problem, remedy)
            return found

        return DirectCurrent(
            value("voltage"),
            value("resistance", "resistance"),
            value("torqueConstant", "torque_constant", self.effort),
            value("dutyGain") / self.length(1.0),
            value("maxDuty", fallback=1.0),
        )


def described_motor(reading: Reading, joint: JointPrim, actuator: str) -> DescribedMotor:
    """What a shot says of the motor of a joint.

    Args:
        actuator: Path of the actuator that drives it, or empty.

    Raises:
        ShotError: A model that does not exist, or a named motor that is not known or does not fit the joint.
    """
    newton = newton_actuator(reading.stage, actuator)
    mujoco = actuators_beside(reading.stage, actuator, joint) if actuator and newton is None else ()
    model, kind = motor_model(joint.prim), named_type(joint)
    return DescribedMotor(joint, reading.units, reading.notes, model, kind, newton, mujoco)


def motor_model(prim: Usd.Prim) -> str:
    """How the motor moves its joint: PRESCRIBED, DRIVE or SERVO.

    Raises:
        ShotError: A model that does not exist.
    """
    problem = "names a model of motors that does not exist"
    model = schemas.choice(prim, SCHEMA, MODEL, (AUTO, *MODELS), problem, AUTO)
    return PRESCRIBED if model == AUTO else model


def named_type(joint: JointPrim) -> MotorType:
    """The motor that the joint names; one without values where it names none.

    Raises:
        ShotError: There is no such motor, or it does not fit the joint; the user's table of motors is wrong.
    """
    name = str(schemas.value(joint.prim, SCHEMA, TYPE) or "").strip()
    if not name:
        return UNKNOWN
    known, linear = motor_types(), joint.kind == "prismatic"
    found = motor_type_named(name, known)
    if found is None:
        remedy = likely_motor_types(name, known)
        raise ShotError("names a motor that is not known", path=joint.path, attribute=TYPE, found=name, remedy=remedy)
    problem = f"names a motor that {_KINDS[not linear]}, but the joint {_KINDS[linear]}"
    remedy = "Name a motor that fits the joint, or remove the attribute"
    schemas.require(found.linear == linear, joint.prim, TYPE, name, problem, remedy)
    return found
