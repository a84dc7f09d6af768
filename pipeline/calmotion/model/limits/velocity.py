"""How fast a motor may be."""

from calmotion.model.limits.base import SymmetricLimit
from calmotion.model.motor import Motor


class VelocityLimit(SymmetricLimit):
    """The rate of the motor's curve [rad/s or m/s]."""

    name, raised_by, order = "velocity", "calm:motor:maxVelocity", 1

    def largest(self, motor: Motor) -> float:
        """Of the motor."""
        return motor.max_velocity
