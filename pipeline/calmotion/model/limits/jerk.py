"""How fast the acceleration of a motor may change."""

from calmotion.model.limits.base import SymmetricLimit
from calmotion.model.motor import Motor


class JerkLimit(SymmetricLimit):
    """The third derivative of the motor's curve [rad/s^3 or m/s^3], constant between the knots of a cubic."""

    name, raised_by, order = "jerk", "calm:motor:maxJerk", 3

    def largest(self, motor: Motor) -> float:
        """Of the motor."""
        return motor.max_jerk
