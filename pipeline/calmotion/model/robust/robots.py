"""Robots that differ from the model, and how motor curves do on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from calmotion.arrays import Array

CURVES = ("before", "nominal", "robust")  # as animated; optimised for the nominal robot; optimised for all robots


@dataclass(frozen=True, eq=False)
class Scenario:
    """A robot that differs from the model.

    Attributes:
        factors: Of its parameters, by their names.
        weight: In the objective; those of all scenarios add up to 1.
    """

    factors: Mapping[str, float] = field(default_factory=dict)
    weight: float = 1.0


@dataclass(frozen=True, eq=False)
class Compromise:
    """Curves that may be farther off on the nominal robot than the robust ones, so that others are less.

    Attributes:
        weight: Of the nominal robot in the sum of squares that is smallest there; those of all robots add up to 1.
        allowed: Error that a target may have on the nominal robot [m].
        nominal: Largest error of each target on the nominal robot [m], shape [K].
        drawn: The same on random robots, shape [draws, K].
    """

    weight: float
    allowed: float
    nominal: Array
    drawn: Array


@dataclass(frozen=True, eq=False)
class Robustness:
    """Motor curves on robots that differ from the model.

    Attributes:
        kind: Of the optimisation, `mean` or `worst`.
        scenarios: The robots for which the curves were optimised, the nominal one first.
        nominal: Largest error of each target on the nominal robot [m], shape [K], by name of the curves (`CURVES`).
        drawn: The same on random robots that the optimisation did not see, shape [draws, K]; infinite where a robot
            could not be simulated.
        compromises: Curves of larger and larger errors on the nominal robot.
    """

    kind: str
    scenarios: tuple[Scenario, ...]
    nominal: Mapping[str, Array]
    drawn: Mapping[str, Array]
    compromises: tuple[Compromise, ...] = ()
