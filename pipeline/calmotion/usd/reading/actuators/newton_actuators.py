"""Newton's actuators: a prim NewtonActuator beside the joint, with a controller, clamps of its effort, and a delay.

Newton has radians here (its joint attributes have degrees), and stage units of mass and length. The DC motor's clamp

    |tau| <= min(maxMotorEffort, saturationEffort (1 - |phi'| / velocityLimit))

is that of a servo whose torque begins to fall at the share 1 - maxMotorEffort / saturationEffort of its no-load speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from calmotion.usd.dialects import number_of

if TYPE_CHECKING:
    from pxr import Usd

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
