"""Actuators of MuJoCo conversions and of Newton: prims beside the joints."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd

from calmotion.usd.dialects import POSITION_ACTUATOR, number_of
from calmotion.usd.reading.joints.joint_prims import JointPrim

_SAME = 1e-6  # of a gain: what a conversion rounds


@dataclass(frozen=True)
class AffineActuator:
    """An actuator whose force on the joint is g (gain ctrl + b_0 + b_1 g q + b_2 g q'), in radians and stage units.

    Attributes:
        prim: Of it.
        ratio: g, of its gear.
        gain: Of its command.
        varies: Whether the gain depends on the pose as well, which is not read.
        offset, slope, rate: b_0, b_1 and b_2. A positive b_2 is a damping ratio, of which MuJoCo's compiler makes one.
    """

    prim: Usd.Prim
    ratio: float
    gain: float
    varies: bool
    offset: float
    slope: float
    rate: float

    @property
    def holds(self) -> bool:
        """Whether it pulls to a position."""
        return self.slope < 0.0 and self.ratio != 0.0

    def value_at(self, command: float) -> float:
        """The value of the joint at which it pulls nowhere."""
        return -(self.gain * command + self.offset) / (self.slope * self.ratio)

    def values(self) -> tuple[float, float]:
        """The values of the joint that its commands reach."""
        integrates = token_of(self.prim, "mjc:dynType") == "integrator"
        name = "mjc:act{}" if integrates else "mjc:ctrl{}"  # commands of such a one are speeds
        low, high = (number_of(self.prim, name.format(f"Range:{end}")) or 0.0 for end in ("min", "max"))
        if token_of(self.prim, name.format("Limited")) == "false" or not low < high:
            return -math.inf, math.inf
        first, last = sorted(map(self.value_at, (low, high)))
        return first, last

    def doubt(self) -> str:
        """What of its commands is not as elsewhere, as words for the user; empty where the command is the joint's
        value times its gear."""
        words = []
        scale = -self.slope / self.gain if self.gain else 1.0
        if abs(scale - 1.0) > _SAME or self.offset:
            times, more = self.ratio * scale, -self.offset / self.gain
            factor = "" if abs(times - 1.0) < _SAME else f"{times:g} times "
            added = f" {'+' if more > 0.0 else '-'} {abs(more):g}" if more else ""
            words.append(f"its command is {factor}the joint's value{added}")
        if self.varies:
            words.append("its gain depends on the pose, which is not read")
        return ", and ".join(words)


def actuators_beside(stage: Usd.Stage, path: str, joint: JointPrim) -> tuple[Usd.Prim, ...]:
    """The actuators that act on the joint itself, not on a tendon: their forces add up.

    Args:
        path: Of one of them; the others are beside it.
    """
    prim = stage.GetPrimAtPath(path)
    return tuple(other for other in prim.GetParent().GetChildren() if _acts_on(other, joint)) if prim else ()


def affine_actuators(actuators: Sequence[Usd.Prim]) -> list[AffineActuator]:
    """Those whose force depends on the joint's own position or speed."""
    found = []
    for prim in actuators:
        gain, bias, gear = (numbers_of(prim, name) for name in POSITION_ACTUATOR)
        unknown = token_of(prim, "mjc:biasType") == "none" or token_of(prim, "mjc:gainType") not in (
            "",
            "fixed",
            "affine",
        )
        if unknown or not gain or not gain[0] or len(bias) < 3:
            continue
        if not np.all(np.isfinite([gain[0], *bias[:3]])) or bias[1] > 0.0:
            continue
        varies = token_of(prim, "mjc:gainType") == "affine" and any(gain[1:3])
        found.append(AffineActuator(prim, gear[0] if gear else 1.0, gain[0], varies, *bias[:3]))
    return found


def reachable(joint: JointPrim, actuators: Sequence[Usd.Prim], meters: float) -> tuple[float, float]:
    """The values of a joint that the commands of its actuator reach [rad or m]; where several hold it, all."""
    holding = [actuator for actuator in affine_actuators(actuators) if actuator.holds]
    if len(holding) != 1 or number_of(joint.prim, "mjc:ref"):
        return -math.inf, math.inf
    low, high = holding[0].values()
    scale = meters if joint.kind == "prismatic" else 1.0
    return scale * low, scale * high


def numbers_of(prim: Usd.Prim, name: str) -> list[float]:
    """The numbers of an attribute; none where it is not there."""
    attribute = prim.GetAttribute(name)
    value: Any = attribute.Get() if attribute else None
    return [] if value is None else [float(v) for v in value]


def token_of(prim: Usd.Prim, name: str) -> str:
    """The token of an attribute; empty where it is not there."""
    attribute = prim.GetAttribute(name)
    return str(attribute.Get() or "") if attribute else ""


def _acts_on(actuator: Usd.Prim, joint: JointPrim) -> bool:
    relationship = actuator.GetRelationship("mjc:target")
    known = actuator.GetTypeName() == "MjcActuator" and bool(relationship)
    return known and joint.prim.GetPath() in relationship.GetTargets()


ACTUATOR, TARGETS = "NewtonActuator", "newton:targets"
_STEPS, _STEPS_PER_SECOND = "newton:delaySteps", "newton:timeStepsPerSecond"
_DELAYS, _DC_MOTOR = "NewtonActuatorDelayAPI", "NewtonDCMotorClampingAPI"
_USUAL_STEPS_PER_SECOND = 1000  # the fallback of NewtonSceneAPI
_NOT_SIMULATED = {
    "newton:ki": "the integral gain",
    "newton:constEffort": "the constant effort",
    "newton:modelPath": "the neural controller",
    "newton:lookupEfforts": "the clamp by position",
}


@dataclass(frozen=True)
class NewtonActuator:
    """The values of an actuator in stage units, angles in radians; those that are not authored are zero or infinite.

    Attributes:
        path: Its prim.
        kp, kd: Gains.
        effort: Largest effort.
        velocity: Speed at which the motor has no effort left.
        knee: Share of it up to which the largest effort is there.
        delay: [s].
        unread: What it has besides, for a note.
    """

    path: str
    kp: float = 0.0
    kd: float = 0.0
    effort: float = math.inf
    velocity: float = math.inf
    knee: float = 0.0
    delay: float = 0.0
    unread: tuple[str, ...] = ()


def newton_actuator(stage: Usd.Stage, path: str) -> NewtonActuator | None:
    """The actuator at a path; None where there is none of Newton.

    Raises:
        ShotError: A value that is not a number.
    """
    prim = stage.GetPrimAtPath(path) if path else None
    if not prim or prim.GetTypeName() != ACTUATOR:
        return None

    def number(name: str, fallback: float) -> float:
        found = number_of(prim, f"newton:{name}")
        return found if found is not None and found >= 0.0 else fallback

    applied = {*prim.GetPrimTypeInfo().GetAppliedAPISchemas(), *prim.GetAppliedSchemas()}
    delayed = _DELAYS in applied or prim.GetAttribute(_STEPS).HasAuthoredValue()
    most, stall = (
        min(number("maxEffort", math.inf), number("maxMotorEffort", math.inf)),
        number("saturationEffort", 0.0),
    )
    velocity = number("velocityLimit", math.inf) if _DC_MOTOR in applied else math.inf
    falls = 0.0 < velocity < math.inf and 0.0 < stall < math.inf
    most = min(most, stall) if falls else most
    return NewtonActuator(
        path, number("kp", 0.0), number("kd", 0.0), most, velocity if falls else math.inf,
        1.0 - most / stall if falls else 0.0,
        number("delaySteps", 1.0) / _steps_per_second(stage) if delayed else 0.0,
        tuple(what for name, what in _NOT_SIMULATED.items() if _is_set(prim, name)),
    )  # fmt: skip


def _is_set(prim: Usd.Prim, name: str) -> bool:
    attribute = prim.GetAttribute(name)
    return bool(attribute) and attribute.HasAuthoredValue() and bool(attribute.Get())


def _steps_per_second(stage: Usd.Stage) -> float:
    """Physics steps in a second, in which Newton counts delays."""
    for prim in stage.Traverse():
        if prim.GetTypeName() == "PhysicsScene":
            found = number_of(prim, _STEPS_PER_SECOND)
            return found if found else _USUAL_STEPS_PER_SECOND
    return _USUAL_STEPS_PER_SECOND
