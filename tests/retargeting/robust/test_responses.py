"""The linear model of several robots as one matrix."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.robust.robots import Scenario
from calmotion.model.run import RunSettings
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.robust.worst_case import _posed, power_mean
from calmotion.simulation.compiled_shot import compile_shot

OPTIONS = RunSettings(step=1 / 120)


@pytest.fixture(scope="module")
def problem(arm, animation, bodies):
    """Of two robots with limits, linearised off the curves of the input."""
    motors = tuple(dataclasses.replace(m, max_acceleration=1.0, max_torque=1.0) for m in arm.motors)
    shot = compile_shot(dataclasses.replace(arm, motors=motors), animation, bodies)
    material = next(body.flexible.material for body in arm.bodies if body.simulated_flexible)
    scenarios = (Scenario(), Scenario({f"modulus {material.path}": 0.9}))
    made, start, _ = _posed(shot, OPTIONS, animation.tracks, scenarios)
    made.norm = power_mean(made, 8, np.ones(len(arm.targets)))
    made.value(start + 1e-3 * np.random.default_rng(1).normal(size=made.size))
    made.linearize()
    return made


def test_products_are_those_of_sweeps(problem):
    d = np.random.default_rng(2).normal(size=problem.size)
    (own, limited), (swept, others) = problem.jvp(d), RetargetProblem.jvp(problem, d)
    assert np.allclose(own, swept, atol=2e-5 * np.abs(swept).max())
    assert limited.keys() == others.keys()
    assert np.allclose(limited["acceleration"], others["acceleration"])
    pulled, expected = (
        jvp(problem.residuals, {}) for jvp in (problem.vjp, lambda *a: RetargetProblem.vjp(problem, *a))
    )
    assert np.allclose(pulled, expected, atol=2e-5 * np.abs(expected).max())


def test_jvp_and_vjp_are_transposes(problem):
    rng = np.random.default_rng(3)
    d, residuals = rng.normal(size=problem.size), rng.normal(size=problem.residuals.shape)
    change, limited = problem.jvp(d)
    pulls = {name: rng.normal(size=v.shape) for name, v in limited.items()}
    one = np.sum(change * residuals) + sum(np.sum(limited[name] * pulls[name]) for name in pulls)
    assert d @ problem.vjp(residuals, pulls) == pytest.approx(one, rel=1e-4)


def test_the_preconditioner_inverts_the_second_derivatives(problem):
    d = np.random.default_rng(4).normal(size=problem.size)
    inverse = problem.precondition(np.zeros(problem.size, bool))
    back = inverse(problem.product(d))
    assert np.linalg.norm(back - d) < 0.2 * np.linalg.norm(d)


def test_damping_is_a_pull_towards_where_it_was_linearised(problem):
    x, d = problem.x.copy(), 1e-3 * np.random.default_rng(5).normal(size=problem.size)
    free, slope = problem.penalty_value(x + d), problem.penalty_gradient(x + d)
    try:
        problem.damping = 5.0
        assert problem.penalty_value(x + d) - free == pytest.approx(2.5 * problem.squared(d), rel=1e-6)
        assert (problem.penalty_gradient(x + d) - slope) @ d == pytest.approx(5.0 * problem.squared(d), rel=1e-6)
        assert problem.penalty_value(x) == pytest.approx(RetargetProblem.penalty_value(problem, x), rel=1e-12)
    finally:
        problem.damping = 0.0
