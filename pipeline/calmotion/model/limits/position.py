"""The range of a joint."""

from calmotion.model.character import Joint
from calmotion.model.limits.base import CurveLimit
from calmotion.model.motor import Motor


class PositionLimit(CurveLimit):
    """The motor's value [rad or m] stays within the limits of its joint."""

    name, raised_by, order, has_sides = "position", "the limits of the joint", 0, True

    def bounds(self, motor: Motor, joint: Joint) -> tuple[float, float]:
        """Those of the joint."""
        return joint.lower, joint.upper
