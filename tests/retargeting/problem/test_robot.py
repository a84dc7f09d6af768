"""A retargeting problem for several robots is the weighted sum of their problems."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.uncertainty import Scenario
from calmotion.retargeting.problem.robot import Robot
from calmotion.retargeting.robust.scenarios import shot_of
from calmotion.simulation.compiled_shot import compile_shot
from posed import make_problem

WEIGHTS = (0.7, 0.3)


@pytest.fixture(scope="module")
def points(arm, animation, bodies):
    """A point in the problem of the nominal robot, of a softer one, and of both."""
    material = next(body.flexible.material for body in arm.bodies if body.simulated_flexible)
    softer = shot_of(compile_shot(arm, animation, bodies), Scenario({f"modulus {material.path}": 0.8}))
    motors = tuple(dataclasses.replace(motor, max_torque=4.0) for motor in arm.motors)
    limited = dataclasses.replace(arm, motors=motors)
    single = [make_problem(limited, own, animation, limited=True) for own in (bodies, softer.bodies)]
    both = single[0].for_robots(
        [Robot(p.robots[0].simulator, p.objective, w) for p, w in zip(single, WEIGHTS, strict=True)]
    )
    x = 0.02 * np.random.default_rng(0).normal(size=both.size)
    return [problem.at(x) for problem in (*single, both)]


def test_the_objective_is_the_weighted_sum(points):
    first, second, both = points
    penalty = both.problem.space.penalty_value(both.x)
    expected = sum(w * (p.objective_value - penalty) for w, p in zip(WEIGHTS, (first, second), strict=True))
    assert both.objective_value == pytest.approx(expected + penalty, rel=1e-12)


def test_gradient_and_product_are_the_weighted_sums(points):
    direction = np.random.default_rng(1).normal(size=len(points[0].x))

    def weighted(parts, regular):
        return sum(w * (part - regular) for w, part in zip(WEIGHTS, parts, strict=True)) + regular

    gradients, products = [], []
    for at in points:
        linear = at.with_limits(dataclasses.replace(at.problem.limits, on=False)).linearized()
        gradients.append(linear.gradient)
        products.append(linear.product(direction))
    space = points[2].problem.space
    for found, of in ((gradients, points[2].x), (products, direction)):
        expected = weighted(found[:2], space.penalty_gradient(of))
        assert np.allclose(found[2], expected, rtol=1e-10, atol=1e-12 * np.abs(expected).max())


def test_every_robot_keeps_the_limits_of_effort(points):
    first, second, both = points
    assert np.array_equal(both.limited["effort"], first.limited["effort"])
    assert np.array_equal(both.limited["effort of robot 1"], second.limited["effort"])
    excess = [at.problem.limits.excess(at.limited) for at in points]
    assert excess[2] == max(excess[:2])


def test_derivatives_that_were_given_up_are_not_used_by_mistake(points):
    at = points[0]
    linear = at.linearized()
    at.problem.at(at.x + 1e-3).linearized()
    with pytest.raises(RuntimeError, match="given up"):
        linear.product(at.x)
