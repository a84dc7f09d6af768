"""Units in which the values of a motor are displayed: angles in degrees, lengths in millimetres."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from calmotion.shot.character import Motor


class Measure(NamedTuple):
    """Words and units for one kind of motor.

    Attributes:
        name, effort: Name of the value, and of the effort.
        unit, effort_unit, si: Unit that is shown, unit of the effort, unit of the value in SI.
        factor: From SI to the unit that is shown.
    """

    name: str
    effort: str
    unit: str
    effort_unit: str
    si: str
    factor: float

    def unit_of(self, quantity: str) -> str:
        """SI unit of a limited quantity: `position`, `velocity`, `acceleration` or `effort`."""
        return {"velocity": f"{self.si}/s", "acceleration": f"{self.si}/s^2", "effort": self.effort_unit}.get(
            quantity, self.si
        )

    def shown(self, quantity: str, value: float) -> str:
        """A value of such a quantity, in SI, as text with the unit that is shown."""
        if quantity == "effort":
            return f"{value:.4g} {self.effort_unit}"
        return f"{self.factor * value:.4g} {self.unit_of(quantity).replace(self.si, self.unit, 1)}"


ANGLE = Measure("angle", "torque", "deg", "N m", "rad", float(np.degrees(1.0)))
LENGTH = Measure("length", "force", "mm", "N", "m", 1e3)


def measure_of(motor: Motor) -> Measure:
    """The measure of a motor."""
    return LENGTH if motor.linear else ANGLE
