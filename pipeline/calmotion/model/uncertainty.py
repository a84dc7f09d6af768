"""What is not known exactly of a robot, robots that differ from the model, and how motor curves do on them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from calmotion.arrays import Array

MEAN, WORST = "mean", "worst"
CURVES = ("before", "nominal", "robust")  # as animated; optimised for the nominal robot; optimised for all robots


@dataclass(frozen=True)
class KnownFactors:
    """What a calibration tells of the factors by which parameters of the robot may differ from the shot.

    Attributes:
        names: Kind and path of each.
        covariance: Of the logarithms of the factors, by rows.
        largest_error_m: Largest difference of recordings from what the calibrated robot predicts of them, at the
            targets [m]; 0 where it is not known.
    """

    names: tuple[str, ...] = ()
    covariance: tuple[tuple[float, ...], ...] = field(default_factory=tuple)
    largest_error_m: float = 0.0


@dataclass(frozen=True)
class Uncertainty:
    """Relative standard deviations s of the parameters of a robot: a parameter is multiplied by (1 + s)^x, where x has
    a standard normal distribution, so that factors and their inverses are equally likely.

    Attributes:
        modulus: Of Young's modulus of each material.
        damping: Of the damping of each material.
        payload: Of the masses of the rigid bodies at the ends of the chains, all by the same factor.
        gains: Of the gains of each compliant motor, position and velocity by the same factor.
        calibrated: Of the parameters that a calibration tells, which count instead.
    """

    modulus: float = 0.1
    damping: float = 1.0
    payload: float = 0.1
    gains: float = 0.2
    calibrated: KnownFactors = KnownFactors()

    def of_modulus(self, material: str) -> float:
        """Relative standard deviation of the modulus of a material, by its path."""
        name = f"modulus {material}"
        if name not in self.calibrated.names:
            return self.modulus
        own = self.calibrated.names.index(name)
        return float(math.expm1(math.sqrt(self.calibrated.covariance[own][own])))


@dataclass(frozen=True)
class RobustSettings:
    """Optimisation for a set of robots.

    Attributes:
        kind: `mean`: the mean of the objective over the robots; `worst`: the robot with the largest error counts most.
        scenarios: Number of robots, the nominal one among them.
        draws: Number of random robots on which the curves are measured afterwards.
        nominal_error: Error that a target may have on the nominal robot where the largest error is minimised, over the
            tolerance, in position and as its rotation weighs; curves for the nominal robot alone may have more.
    """

    kind: str = WORST
    scenarios: int = 7
    draws: int = 200
    nominal_error: float = 2.0


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
class Robustness:
    """Motor curves on robots that differ from the model.

    Attributes:
        kind: Of the optimisation, `mean` or `worst`.
        scenarios: The robots for which the curves were optimised, the nominal one first.
        nominal: Largest errors of position [m] and rotation [rad] of each target on the nominal robot, shape [K, 2], by
            name of the curves (`CURVES`).
        drawn: The same on random robots that the optimisation did not see, shape [draws, K, 2]; infinite where a robot
            could not be simulated.
    """

    kind: str
    scenarios: tuple[Scenario, ...]
    nominal: Mapping[str, Array]
    drawn: Mapping[str, Array]
