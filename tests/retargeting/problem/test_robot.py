"""A retargeting problem for several robots is the weighted sum of their problems."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.robust.robots import Scenario
from calmotion.retargeting.problem.robot import Robot
from calmotion.retargeting.robust.scenarios import shot_of
from calmotion.simulation.compiled_shot import compile_shot
from posed import make_problem

WEIGHTS = (0.7, 0.3)


@pytest.fixture(scope="module")
def problems(arm, animation, bodies):
    """The problem of the nominal robot, of a softer one, and of both; evaluated and linearised at the same point."""
    material = next(body.flexible.material for body in arm.bodies if body.simulated_flexible)
    softer = shot_of(compile_shot(arm, animation, bodies), Scenario({f"modulus {material.path}": 0.8}))
    motors = tuple(dataclasses.replace(motor, max_torque=4.0) for motor in arm.motors)
    limited = dataclasses.replace(arm, motors=motors)
    single = [make_problem(limited, own, animation, limited=True) for own in (bodies, softer.bodies)]
    robots = [
        Robot(problem.robots[0].simulator, problem.objective, weight)
        for problem, weight in zip(single, WEIGHTS, strict=True)
    ]
    # simulators keep their linearisation, so the problem of both has its own
    fresh = [make_problem(limited, own, animation, limited=True) for own in (bodies, softer.bodies)]
    both = fresh[0].for_robots(
        [Robot(p.robots[0].simulator, p.objective, r.weight) for p, r in zip(fresh, robots, strict=True)]
    )
    x = 0.02 * np.random.default_rng(0).normal(size=both.size)
    for problem in (*single, both):
        assert np.isfinite(problem.value(x))
    return *single, both, x


def test_the_objective_is_the_weighted_sum(problems):
    first, second, both, x = problems
    penalty = 0.5 * float(x @ both.penalty_gradient(x))
    expected = sum(
        w * (p.objective_value() - penalty) for w, p in zip(WEIGHTS, (first, second), strict=True)
    )  # fmt: skip
    assert both.objective_value() == pytest.approx(expected + penalty, rel=1e-12)


def test_gradient_and_product_are_the_weighted_sums(problems):
    first, second, both, x = problems
    direction = np.random.default_rng(1).normal(size=len(x))
    for problem in (first, second, both):
        problem.limits.on = False
    gradients = [problem.linearize() for problem in (first, second)]
    regular = both.penalty_gradient(x)
    expected = sum(w * (g - regular) for w, g in zip(WEIGHTS, gradients, strict=True)) + regular
    assert np.allclose(both.linearize(), expected, rtol=1e-10, atol=1e-12 * np.abs(expected).max())
    products = [problem.product(direction) for problem in (first, second)]
    regular = both.penalty_gradient(direction)
    expected = sum(w * (p - regular) for w, p in zip(WEIGHTS, products, strict=True)) + regular
    assert np.allclose(both.product(direction), expected, rtol=1e-10, atol=1e-12 * np.abs(expected).max())


def test_every_robot_keeps_the_limits_of_effort(problems):
    first, second, both, _ = problems
    assert np.array_equal(both.limited["effort"], first.limited["effort"])
    assert np.array_equal(both.limited["effort of robot 1"], second.limited["effort"])
    assert both.limits.excess(both.limited) == max(p.limits.excess(p.limited) for p in (first, second))


def test_jvp_and_vjp_are_transposes(problems):
    *_, both, x = problems
    random = np.random.default_rng(2)
    both.limits.on = True
    both.linearize()
    direction = random.normal(size=len(x))
    residuals, values = both.jvp(direction)
    pulls = random.normal(size=residuals.shape)
    efforts = {name: 1e-3 * random.normal(size=v.shape) for name, v in values.items() if name.startswith("effort")}
    assert len(efforts) == 2
    forward = float(np.sum(residuals * pulls)) + sum(float(np.sum(values[n] * e)) for n, e in efforts.items())
    backward = float(direction @ both.vjp(pulls, efforts))
    assert forward == pytest.approx(backward, rel=1e-9)
