"""The linear model of several robots as one matrix."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.limits.bounds import Bounds
from calmotion.model.run import RunSettings
from calmotion.model.uncertainty import Scenario
from calmotion.retargeting.problem.limits import MARGIN
from calmotion.retargeting.problem.responses import Responses
from calmotion.retargeting.problem.sweeps import Sweeps
from calmotion.retargeting.robust.worst_case import _posed, power_mean
from calmotion.retargeting.solver.elastic_program import elastic_minimum
from calmotion.retargeting.solver.limited_step import LimitedModel, limited_step
from calmotion.retargeting.solver.norm import SumOfSquares
from calmotion.simulation.compiled_shot import compile_shot
from scipy.sparse import csr_matrix

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
    assert limited.keys() == others.keys() and {"effort", "effort of robot 1"} < limited.keys()
    for name, changes in others.items():
        assert np.allclose(limited[name], changes, atol=2e-5 * np.abs(changes).max())
    pulls = {name: np.random.default_rng(5).normal(size=v.shape) for name, v in others.items()}
    pulled, expected = (one.vjp(linear.residuals, pulls) for one in (linear, swept))
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


def test_responses_of_another_point_have_the_gradient_of_sweeps(linear):
    """A search under limits takes them along; only the second derivatives are those of the other point."""
    swept = dataclasses.replace(linear, sweeps=Sweeps(linear.sweeps.robots, linear.space), pull=0.0)
    other = Responses(linear.sweeps.robots, linear.space, linear.sweeps.motors)
    other.__dict__["_by_unknowns"] = [(1.1 * rows, 0.9 * efforts) for rows, efforts in linear.sweeps._by_unknowns]
    model = swept.by_responses(other)
    assert model.sweeps is other
    assert np.allclose(model.gradient, swept.gradient, rtol=1e-9, atol=1e-12 * np.abs(swept.gradient).max())
    start = LimitedModel(model)
    assert np.allclose(start.gradient(start.start), swept.gradient, rtol=1e-9, atol=1e-9 * np.abs(swept.gradient).max())


def test_a_step_by_the_matrix_is_the_minimum_of_a_quadratic_program(linear):
    """Under limits of acceleration and effort that can be kept; the program is made of sweeps."""
    limits, values = linear.limits, linear.limited
    most = {name: 0.95 * np.abs(v[limits.judged]).max(axis=0) for name, v in values.items()}
    bounds = {name: Bounds.between(-largest, largest) for name, largest in most.items()}
    swept = dataclasses.replace(
        linear, sweeps=Sweeps(linear.sweeps.robots, linear.space), pull=0.0, norm=SumOfSquares(), _stiff={},
        limits=dataclasses.replace(limits, bounds=bounds),
    )  # fmt: skip
    columns = [swept.jvp(d) for d in np.eye(linear.space.size)]
    J = np.stack([residuals.ravel() for residuals, _ in columns], axis=1)
    H = J.T @ J + np.stack([linear.space.penalty_gradient(d) for d in np.eye(linear.space.size)], axis=1)
    g = J.T @ linear.residuals.ravel() + linear.space.penalty_gradient(linear.x)
    rows, room = [], []
    for name, v in values.items():
        change = np.stack([own[name][limits.judged].ravel() for _, own in columns], axis=1)
        now, largest = v[limits.judged].ravel(), np.tile(most[name], np.count_nonzero(limits.judged))
        for sign in (1.0, -1.0):
            rows.append(sign * change / largest[:, None])
            room.append(1.0 - MARGIN - sign * now / largest)
    exact = elastic_minimum(csr_matrix(H), g, csr_matrix(np.concatenate(rows)), np.concatenate(room), 1e6).x
    model = swept.by_responses()
    assert isinstance(model.sweeps, Responses)
    found = limited_step(model, np.zeros(len(g), bool), 1e-6, 0.0, 300, is_matrix=True)
    assert np.max(np.concatenate(rows) @ found.step - np.concatenate(room)) < 2e-4
    assert found.eased == pytest.approx(-(g @ exact + 0.5 * exact @ H @ exact), rel=1e-2)
