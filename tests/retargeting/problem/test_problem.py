"""The gradient of the whole chain: pre-roll, static start, every term, limits, loops and nonlinear materials."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import WeightTrack
from calmotion.model.run import RunSettings
from calmotion.multibody.model.topology import span_tree
from calmotion.retargeting.solver.limited_step import LimitedModel, ModelPoint
from calmotion.simulation.bodies import reduce_bodies, with_elasticity
from calmotion.simulation.body_reduction import load_envelopes
from linkage_arm import linkage_arm, performance
from posed import looped, make_problem


def limited_motors(character, scale=1.0):
    """Limits that the motion of the tests exceeds at some instants."""
    tight = {"max_velocity": 2.0 * scale, "max_acceleration": 12.0 * scale, "max_torque": 4.0 * scale}
    joints = tuple(dataclasses.replace(j, lower=-0.5 * scale, upper=0.3 * scale) for j in character.joints)
    motors = tuple(dataclasses.replace(motor, **tight) for motor in character.motors)
    return dataclasses.replace(character, motors=motors, joints=joints)


def linkage(elasticity):
    character, meshes = linkage_arm(modes=-1 if elasticity == "auto" else 4)
    character = with_elasticity(character, elasticity)
    animation = performance(0.8)
    loads = load_envelopes(character, animation, meshes, RunSettings())
    return character, reduce_bodies(character, span_tree(character), meshes, None, loads), animation


CASES = [
    "rest",
    "pre-roll",
    "kept",
    "limits",
    "rotation alone",
    "static reference",
    "linkage",
    "linkage, neohookean",
    "loop",
    "loop, limits",
]


@pytest.fixture(scope="module", params=CASES)
def linearized(request, arm, bodies, animation):
    kind = request.param
    if kind.startswith("linkage"):
        parts = linkage("neohookean" if "neo" in kind else "stvk")
        parts = (limited_motors(parts[0], 0.4), *parts[1:])
        problem = make_problem(*parts, limited=True)
    else:
        character = limited_motors(arm) if "limits" in kind else arm
        if kind.startswith("loop"):
            character, animation = looped(character, animation)
        if kind == "rotation alone":
            targets = tuple(dataclasses.replace(t, position_weight=0.0, rotation_weight=1.0) for t in arm.targets)
            character = dataclasses.replace(arm, targets=targets)
        problem = make_problem(
            character, bodies, animation, 0.25 if kind == "pre-roll" else 0.0, kind == "kept", "limits" in kind,
            kind.startswith("static"),
        )  # fmt: skip
    x = (0.005 if kind.startswith("linkage") else 0.02) * np.random.default_rng(0).normal(size=problem.size)
    at = problem.at(x)
    return at, at.linearized()


def test_gradient_matches_central_differences_of_the_whole_simulation(linearized):
    at, linear = linearized
    problem, x = at.problem, at.x
    rng = np.random.default_rng(1)
    for _ in range(2):
        d = rng.normal(size=len(x))

        def difference(e, d=d):
            return (problem.at(x + e * d).merit - problem.at(x - e * d).merit) / (2 * e)

        # terms of limits have corners in their second derivative, so a step that crosses none of them must be found
        steps = (1e-4,) if problem.limits is None else (3e-4, 1e-4, 3e-5, 1e-5)
        found = ((4.0 * difference(e) - difference(2 * e)) / 3.0 for e in steps)
        # efforts come out of Newton's method with fewer digits than motions, those of loops with fewer still
        accuracy = 1e-7 if problem.limits is None else 2e-6 if problem.grid.cyclic else 1e-6
        assert any(abs(linear.gradient @ d - value) / abs(value) < accuracy for value in found)


def test_product_is_symmetric_and_follows_the_change_of_the_residuals(linearized):
    at, problem = linearized
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, len(at.x)))
    Ha, Hb = problem.product(a), problem.product(b)
    # the terms of either sum cancel in part
    assert abs(a @ Hb - b @ Ha) < 5e-11 * (np.abs(a) @ np.abs(Hb))
    residuals, values = problem.jvp(a)
    change = np.sum(residuals**2) + a @ problem.space.penalty_gradient(a)
    if problem.limits is not None:
        weights = {name: problem.limits.curvature(name, v) for name, v in problem.limited.items()}
        assert all(np.any(w) for w in weights.values()), "every limit should act somewhere"
        change += sum(np.sum(weights[name] * v**2) for name, v in values.items())
    assert abs(a @ Ha - change) < 5e-11 * change


def test_model_is_the_merit_to_second_order(linearized):
    at, problem = linearized
    if problem.limits is None:
        pytest.skip("there are no limits")
    d = np.random.default_rng(3).normal(size=len(at.x))
    residuals, values = problem.jvp(d)
    way = ModelPoint(d, residuals, values)
    model = LimitedModel(problem)
    start = model.start
    assert model.merit(start) == pytest.approx(at.merit, rel=1e-12)
    assert model.slope(start, way) == pytest.approx(problem.gradient @ d, rel=1e-10)
    there = start.moved(way, 1e-3)
    e = 1e-6
    slope = (model.merit(there.moved(way, e)) - model.merit(there.moved(way, -e))) / (2 * e)
    assert model.slope(there, way) == pytest.approx(slope, rel=1e-5)
    assert model.gradient(there) @ d == pytest.approx(model.slope(there, way), rel=1e-10)


def test_static_start_follows_the_curves(arm, bodies, animation):
    """A change of the first coefficient alone already moves the first instant."""
    problem = make_problem(arm, bodies, animation, 0.0)
    d = np.zeros(problem.size)
    d[1] = 1.0  # elbow
    change, _ = problem.at(np.zeros(problem.size)).linearized().jvp(d)
    assert np.abs(change[0, 6:12]).max() > 1e-3  # of the second target


def test_weights_that_change_in_time_weigh_each_instant(arm, bodies, animation):
    track = WeightTrack(1, False, np.array([0.5, 1.0]), np.array([0.0, 2.0]))
    problem = make_problem(arm, bodies, dataclasses.replace(animation, weights=(track,)))
    weights, times = problem.objective.weights, problem.grid.times
    plain = make_problem(arm, bodies, animation).objective.weights
    assert np.all(weights[times < 0.5, 1, :3] == 0.0)
    assert np.allclose(weights[times > 1.0, 1, :3] ** 2, 2.0 * plain[times > 1.0, 1, :3] ** 2)
    assert np.array_equal(weights[:, 0], plain[:, 0]) and np.array_equal(weights[:, 1, 3:], plain[:, 1, 3:])
