"""The torque or force that a motor has."""

import numpy as np

from calmotion.arrays import Array
from calmotion.model.character import Joint
from calmotion.model.limits.base import MotorLimit, MotorMotion
from calmotion.model.motor import SERVO, Measure, Motor


class EffortLimit(MotorLimit):
    """The effort by which the motor moves its joint [N m or N]; a servo cannot exceed its own."""

    name, raised_by = "effort", "calm:motor:maxTorque"

    def bounds(self, motor: Motor, joint: Joint) -> tuple[float, float]:
        """As much in both directions."""
        largest = np.inf if motor.model == SERVO else motor.max_torque
        return -largest, largest

    def values(self, motion: MotorMotion) -> Array:
        """The efforts."""
        return motion.efforts

    def unit(self, measure: Measure, value_unit: str) -> str:
        """The same for all."""
        return measure.effort_unit

    def shown(self, measure: Measure, value: float) -> str:
        """A value as text, in SI."""
        return f"{value:.4g} {measure.effort_unit}"
