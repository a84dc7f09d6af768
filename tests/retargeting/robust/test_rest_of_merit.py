"""The rest of the merit about a point, against differences and against the problem."""

import dataclasses

import numpy as np
import pytest
from calmotion.retargeting.problem.rigid_approximation import rigid_response
from calmotion.retargeting.robust.rest_of_merit import RestOfMerit
from posed import make_problem


@pytest.fixture(scope="module")
def problem(arm, animation, bodies):
    motors = tuple(
        dataclasses.replace(m, max_torque=4.0, max_velocity=0.5, max_acceleration=2.0) for m in arm.motors
    )  # fmt: skip
    made = make_problem(dataclasses.replace(arm, motors=motors), bodies, animation, limited=True)
    made.value(0.02 * np.random.default_rng(0).normal(size=made.size))
    return made


def rest_of(problem, damping=0.0):
    inertia = rigid_response(
        problem.model, problem.grid, problem.curves, problem.world, problem.space.coupling
    ).inertia  # fmt: skip
    return RestOfMerit(problem.space, problem.x.copy(), problem.limits, problem.limited, inertia, damping)


def test_its_derivatives_are_those_of_differences(problem):
    rest, rng = rest_of(problem, 0.7), np.random.default_rng(1)
    d, step = 0.01 * rng.normal(size=problem.size), 1e-6
    gradient, matrix = rest.derivatives(d)
    for u in rng.normal(size=(3, problem.size)):
        slope = (rest.value(d + step * u) - rest.value(d - step * u)) / (2.0 * step)
        assert gradient @ u == pytest.approx(slope, rel=1e-6)
        turned = (rest.derivatives(d + step * u)[0] - rest.derivatives(d - step * u)[0]) / (2.0 * step)
        assert np.allclose(matrix @ u, turned, rtol=0.0, atol=1e-4 * np.abs(turned).max())


def test_without_efforts_it_is_the_rest_of_the_problem(problem):
    rest, d = rest_of(problem), 0.01 * np.random.default_rng(2).normal(size=problem.size)
    kept = {name: v for name, v in rest.limited.items() if name != "effort"}
    limits = dataclasses.replace(rest.limits, bounds={name: rest.limits.bounds[name] for name in kept})
    without = dataclasses.replace(rest, limits=limits, limited=kept)
    changed = problem.space.changed(problem.curves, problem.x + d)
    values = {"position": changed.angles, "velocity": changed.rates, "acceleration": changed.accelerations}
    expected = problem.penalty_value(problem.x + d) + limits.value({name: values[name] for name in kept})
    assert without.value(d) == pytest.approx(expected, rel=1e-9)


def test_damping_is_half_of_the_squared_change_of_the_offsets(problem):
    d = 0.01 * np.random.default_rng(3).normal(size=problem.size)
    offsets, _ = problem.space.offsets(d)
    squared = problem.grid.h * np.sum(offsets**2)
    assert rest_of(problem).squared(d) == pytest.approx(squared, rel=0.02)
    assert rest_of(problem, 2.0).value(d) - rest_of(problem).value(d) == pytest.approx(rest_of(problem).squared(d))


def test_the_excess_times_its_multipliers_is_that_of_the_sides_that_act(problem):
    rest, d = rest_of(problem), 0.01 * np.random.default_rng(4).normal(size=problem.size)
    rest.limits.on = True
    total, gradient = rest.multiplied(d)
    free = dataclasses.replace(rest, limits=None)
    assert np.allclose(gradient, rest.derivatives(d)[0] - free.derivatives(d)[0])
    assert free.multiplied(d)[0] == 0.0 and not np.any(free.multiplied(d)[1])
    expected = 0.0
    for name, v in rest._changed(d).items():
        slope, bound = rest.limits.gradient(name, v), rest.limits.bounds[name]
        acting = np.where(slope > 0.0, bound.upper, bound.lower)
        expected += float(np.sum(np.where(slope != 0.0, slope * (v - np.where(np.isfinite(acting), acting, 0.0)), 0.0)))
    assert total == pytest.approx(expected) and total > 0.0
