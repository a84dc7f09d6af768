"""How fast the speed of a motor may change."""

from calmotion.model.limits.base import SymmetricLimit
from calmotion.model.motor import Motor


class AccelerationLimit(SymmetricLimit):
    """The second derivative of the motor's curve [rad/s^2 or m/s^2]."""

    name, raised_by, order = "acceleration", "calm:motor:maxAcceleration", 2

    def largest(self, motor: Motor) -> float:
        """Of the motor."""
        return motor.max_acceleration
