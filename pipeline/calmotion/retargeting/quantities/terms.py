"""What plugins add to a search. Nothing heavy is imported here, since they derive from these classes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from calmotion.arrays import Array
from calmotion.model import Character

if TYPE_CHECKING:
    from calmotion.multibody.model.model import Model
    from calmotion.retargeting.quantities.base import Quantity
    from calmotion.simulation.inputs.time_grid import TimeGrid


class SearchTerm(ABC):
    """What a plugin adds to a search: a frozen dataclass of its settings, whose `repr` tells it from others.

    Attributes:
        name: Of its quantity, in reports.
        unit: Of its quantity, in SI.
    """

    name: ClassVar[str]
    unit: ClassVar[str] = ""

    @abstractmethod
    def quantity(self, character: Character, model: Model, grid: TimeGrid) -> Quantity:
        """Its quantity of one robot, R numbers at each of the T instants of the grid.

        Raises:
            ShotError: The shot lacks something.
        """

    def labels(self, character: Character) -> Sequence[str]:
        """What each of the R numbers belongs to, such as paths of motors; empty where there is only one."""
        return ()


class AddedResidual(SearchTerm):
    """A quantity r of which int weight |r|^2 dt / 2 is made small, beside the squared errors at the targets."""

    @abstractmethod
    def weight(self, times: Array) -> Array | float:
        """At the instants [m^2 per square of the unit], over the weight of a position error: shape [T], or a number."""


class AddedLimit(SearchTerm):
    """A quantity that stays within bounds at all instants of the shot."""

    @abstractmethod
    def bounds(self, character: Character) -> tuple[Array | float, Array | float]:
        """The least and the largest value, infinite where there is none: shape [R] each, or a number for all."""


@dataclass(frozen=True)
class SearchTerms:
    """What operators add to a search; those of several operators add up."""

    terms: tuple[SearchTerm, ...]

    @classmethod
    def joined(cls, parts: Sequence[SearchTerms]) -> SearchTerms:
        """Those of all."""
        return cls(tuple(term for part in parts for term in part.terms))
