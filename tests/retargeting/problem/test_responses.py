"""The linear model of several robots as one matrix."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.model.uncertainty import Scenario
from calmotion.retargeting.problem.sweeps import Sweeps
from calmotion.retargeting.robust.worst_case import _posed, power_mean
from calmotion.simulation.compiled_shot import compile_shot

OPTIONS = RunSettings(step=1 / 120)


@pytest.fixture(scope="module")
def linear(arm, animation, bodies):
    """A problem of two robots with limits, off the curves of the input."""
    motors = tuple(dataclasses.replace(m, max_acceleration=1.0, max_torque=1.0) for m in arm.motors)
    shot = compile_shot(dataclasses.replace(arm, motors=motors), animation, bodies)
    material = next(body.flexible.material for body in arm.bodies if body.simulated_flexible)
    scenarios = (Scenario(), Scenario({f"modulus {material.path}": 0.9}))
    start, _ = _posed(shot, OPTIONS, animation.tracks, scenarios)
    mean = power_mean(start.problem, 8, np.ones((len(arm.targets), 2)))
    x = start.x + 1e-3 * np.random.default_rng(1).normal(size=start.problem.size)
    return dataclasses.replace(start.problem, norm=mean).at(x).linearized()


def test_products_are_those_of_sweeps(linear):
    swept = dataclasses.replace(linear, sweeps=Sweeps(linear.sweeps.robots, linear.space))
    d = np.random.default_rng(2).normal(size=linear.space.size)
    (own, limited), (expected, others) = linear.jvp(d), swept.jvp(d)
    assert np.allclose(own, expected, atol=2e-5 * np.abs(expected).max())
    assert limited.keys() == others.keys() and np.allclose(limited["acceleration"], others["acceleration"])
    pulled, expected = (one.vjp(linear.residuals, {}) for one in (linear, swept))
    assert np.allclose(pulled, expected, atol=2e-5 * np.abs(expected).max())


def test_jvp_and_vjp_are_transposes(linear):
    rng = np.random.default_rng(3)
    d, residuals = rng.normal(size=linear.space.size), rng.normal(size=linear.residuals.shape)
    change, limited = linear.jvp(d)
    pulls = {name: rng.normal(size=v.shape) for name, v in limited.items()}
    one = np.sum(change * residuals) + sum(np.sum(limited[name] * pulls[name]) for name in pulls)
    assert d @ linear.vjp(residuals, pulls) == pytest.approx(one, rel=1e-4)


def test_the_preconditioner_inverts_the_second_derivatives(linear):
    free = dataclasses.replace(linear, limits=None, limited={})
    d = np.random.default_rng(4).normal(size=linear.space.size)
    back = free.precondition(np.zeros(len(d), bool))(free.product(d))
    assert np.linalg.norm(back - d) < 0.2 * np.linalg.norm(d)
