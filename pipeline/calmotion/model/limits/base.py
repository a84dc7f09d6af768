"""A kind of limit of the motors: what is limited, by how much, and what the user would raise."""

from abc import ABC, abstractmethod
from typing import ClassVar, Protocol

from calmotion.arrays import Array
from calmotion.model.character import Joint
from calmotion.model.motor import Measure, Motor


class MotorMotion(Protocol):
    """What motors do at T instants."""

    @property
    def derivatives(self) -> tuple[Array, ...]:
        """Their curves [rad or m] and the first derivatives of these by time, shape [T, M] each."""

    @property
    def efforts(self) -> Array:
        """Their torques [N m] or forces [N], shape [T, M]."""


class MotorLimit(ABC):
    """A quantity of each motor that stays within bounds at all instants. A new kind is a module of this folder.

    Attributes:
        name: Of the quantity, as reports have it.
        raised_by: What the user changes to allow more.
        has_sides: Whether the bounds differ in more than their sign.
    """

    name: ClassVar[str]
    raised_by: ClassVar[str]
    has_sides: ClassVar[bool] = False

    @abstractmethod
    def bounds(self, motor: Motor, joint: Joint) -> tuple[float, float]:
        """The least and the largest value, infinite where there is none, in SI."""

    @abstractmethod
    def values(self, motion: MotorMotion) -> Array:
        """The quantity, shape [T, M]."""

    @abstractmethod
    def unit(self, measure: Measure, value_unit: str) -> str:
        """The unit of the quantity for the unit of a motor's value."""

    def shown(self, measure: Measure, value: float) -> str:
        """A value in SI as text, with the unit that is shown."""
        return f"{measure.factor * value:.4g} {self.unit(measure, measure.unit)}"


class CurveLimit(MotorLimit):
    """A limit of the curves themselves: of their derivative of an order, which is linear in what a search changes."""

    order: ClassVar[int]

    def values(self, motion: MotorMotion) -> Array:
        """The derivative of the curves."""
        return motion.derivatives[self.order]

    def unit(self, measure: Measure, value_unit: str) -> str:
        """The unit of the derivative."""
        return value_unit + ("", "/s")[self.order] if self.order < 2 else f"{value_unit}/s^{self.order}"


class SymmetricLimit(CurveLimit):
    """The same in both directions."""

    @abstractmethod
    def largest(self, motor: Motor) -> float:
        """The largest size, in SI."""

    def bounds(self, motor: Motor, joint: Joint) -> tuple[float, float]:
        """As much in both directions."""
        return -self.largest(motor), self.largest(motor)
