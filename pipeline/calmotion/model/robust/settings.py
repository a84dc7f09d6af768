"""What is not known exactly of a robot, and what the user asks for because of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from calmotion.model.robust.known_factors import KnownFactors

MEAN, WORST = "mean", "worst"


@dataclass(frozen=True)
class Uncertainty:
    """Relative standard deviations s of the parameters of a robot: a parameter is multiplied by (1 + s)^x, where x has
    a standard normal distribution, so that factors and their inverses are equally likely.

    Attributes:
        modulus: Of Young's modulus of each material.
        damping: Of the damping of each material.
        payload: Of the masses of the rigid bodies at the ends of the chains, all by the same factor.
        gains: Of the gains of each motor that gives, position and velocity by the same factor.
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
            tolerance; curves for the nominal robot alone may have more.
        tradeoff: Number of further curves, each of which may be twice as far off on the nominal robot as the one
            before.
    """

    kind: str = WORST
    scenarios: int = 7
    draws: int = 200
    nominal_error: float = 2.0
    tradeoff: int = 0
