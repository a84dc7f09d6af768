"""A residual that the engine does not know is one class: its squares are minimised with exact derivatives."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from calmotion.multibody.model.model import Model
from calmotion.retargeting.quantities.base import Quantity, RobotChange
from calmotion.retargeting.quantities.efforts import Efforts
from posed import make_problem


@dataclass(frozen=True, eq=False)
class Power(Quantity):
    """Squared efforts of the motors, which heat them, times a weight."""

    model: Model
    weight: float
    by_efforts = True

    def values(self, run):
        return self.weight * Efforts(self.model).values(run) ** 2

    def slopes(self, run):
        return PowerSlopes(2.0 * self.weight * Efforts(self.model).values(run))


@dataclass(frozen=True, eq=False)
class PowerSlopes:
    by_effort: np.ndarray

    def change(self, by: RobotChange):
        return self.by_effort * by.efforts

    def pull(self, values, onto: RobotChange):
        onto.efforts += self.by_effort * values


def test_its_gradient_and_products_are_those_of_differences(arm, bodies, animation):
    plain = make_problem(arm, bodies, animation)
    (robot,) = plain.robots
    problem = replace(plain, robots=(replace(robot, residuals=(Power(robot.model, 1e-4),)),))
    rng = np.random.default_rng(5)
    x, d = (1e-2 * rng.normal(size=problem.size) for _ in range(2))
    at = problem.at(x)
    assert at.objective_value > 1.001 * plain.at(x).objective_value, "it should count"
    e = 1e-4
    ends = [problem.at(x + s * e * d).merit for s in (2, 1, -1, -2)]
    slope = (8.0 * (ends[1] - ends[2]) - (ends[0] - ends[3])) / (12.0 * e)
    linear = at.linearized()
    assert linear.gradient @ d == pytest.approx(slope, rel=1e-6)
    change, _ = linear.jvp(d)
    product = linear.product(d)
    assert d @ product == pytest.approx(np.sum(change**2) + d @ problem.space.penalty_product(d), rel=1e-10)
