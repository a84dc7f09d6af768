"""Limits of what feet ask of the ground: their values against the report of feet, their derivatives against
differences."""

from dataclasses import replace

import calmotion as cm
import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.retargeting.problem import linear_problem
from calmotion.retargeting.problem.posing import locked_coefficients, pose
from calmotion.retargeting.problem.robot import GROUND
from calmotion.retargeting.quantities.ground import SPEED, ground_bounds
from calmotion.retargeting.quantities.kept_feet import with_kept_feet
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulate import intended_motion
from calmotion.simulation.standing.held_feet import held_feet
from steppers import LEGS, ROBOT, giving, write_stepper

STEP, FRICTION = 1 / 96, 0.05


def slippery(stage):
    giving(stage)
    for side in LEGS:
        stage.GetPrimAtPath(f"{ROBOT}/{side}/Foot/Sole").GetAttribute("calm:contact:friction").Set(FRICTION)


@pytest.fixture(scope="module")
def posed(tmp_path_factory):
    """The problem of a robot whose motors give, on narrow and slippery soles, and its shot."""
    path = write_stepper(tmp_path_factory.mktemp("ground") / "stepper.usda", slippery, width=0.12)
    shot, options = cm.open_shot(path), RunSettings(step=STEP)
    found = prepare(compile_shot(shot.character, shot.animation), options)
    curves = sample_curves(shot.animation.tracks, found.grid)
    intended = intended_motion(found, curves.angles, curves.rates)
    problem, _, _ = pose(found, curves, intended, options)
    start = np.zeros(problem.size)  # the animation
    problem = with_kept_feet(found, problem.at(start)).problem
    locked = locked_coefficients(shot.animation, problem.space.basis, problem.space.motors, problem.grid.end)
    return path, problem, start, locked


def test_values_are_those_of_the_report(posed):
    path, problem, start, _ = posed
    limits, values = problem.robots[0].limited[GROUND].limits, problem.at(start).limited[GROUND]
    simulated = cm.simulate(path, step=STEP)
    left, right = held_feet(simulated.shot.character, simulated.result.before.motion)
    weight = 9.81 * sum(body.mass.mass for body in simulated.shot.character.bodies)
    first = np.flatnonzero(limits.joints != limits.joints[0])[0]
    for foot, row in ((left, 0), (right, first)):
        pushes = values[np.isfinite(limits.lower[:, row]), row]
        assert pushes.min() * weight == pytest.approx(foot.normal[0], rel=1e-6)
    velocity = values[limits.landings[0].instant, -3:] * SPEED
    assert np.linalg.norm(velocity) == pytest.approx(right.landing_speed, rel=1e-6)
    # the centre of pressure: the rows of edges come after the force and the cone
    edges = (limits.lower + np.where(np.isfinite(limits.lower), values[:, : len(limits.joints)], 0.0))[:, 9:first]
    counts = np.isfinite(limits.lower[:, 0])
    margin = (edges[counts] / values[counts, :1]).min() * 0.12
    assert margin == pytest.approx(left.margin[0], abs=2e-4)
    # the cone: within a pyramid that is inside of it
    needed = values[counts][:, 1:9] + limits.lower[counts][:, 1:9]
    assert (needed.min() < 0.0) == (left.friction[0] > FRICTION * np.cos(np.pi / 8))


def test_derivatives_agree_with_differences_and_are_transposed(posed):
    _, problem, start, locked = posed
    rng = np.random.default_rng(3)
    x, direction = (np.where(locked, 0.0, rng.standard_normal(problem.size)) for _ in range(2))
    x = start + 0.01 * x
    linear = problem.at(x).with_limits(replace(problem.limits, on=True)).linearized()
    residuals, changes = linear.jvp(direction)
    pulls = rng.standard_normal(changes[GROUND].shape)
    back = linear.vjp(np.zeros_like(residuals), {GROUND: pulls})
    assert back @ direction == pytest.approx(float(np.sum(pulls * changes[GROUND])), rel=1e-9)
    eps, sides = 1e-6, []
    for sign in (1.0, -1.0):
        sides.append(problem.at(x + sign * eps * direction).limited[GROUND])
    differences = (sides[0] - sides[1]) / (2.0 * eps)
    assert np.abs(differences - changes[GROUND]).max() < 1e-6 * np.abs(differences).max()
    moving = np.abs(differences).max(axis=0) > 0.0
    assert np.count_nonzero(~moving) == 1 and not moving[-2]  # no motor moves a foot sideways


def test_bounds_let_landings_be_as_fast_as_animated(posed):
    _, problem, _, _ = posed
    limits = problem.robots[0].limited[GROUND].limits
    bounds = ground_bounds(limits)
    assert np.all(bounds.upper[-3:] == limits.landings[0].speeds / SPEED) and np.all(np.isinf(bounds.upper[:-3]))


def test_of_stiff_rows_those_that_pull_most_are_part_of_the_inverse(posed, monkeypatch):
    _, problem, start, locked = posed
    at, limits = problem.at(start), replace(problem.limits, on=True, rho=1e-3)
    linear = at.with_limits(limits).linearized()
    kept = {name: np.where(np.isfinite(v), 1.0, v) if name == GROUND else v for name, v in at.limited.items()}
    kept[GROUND][:, -3:] = 0.0
    plain = linear.precondition(locked, None, limits, kept)
    d = np.where(locked, 0.0, np.random.default_rng(0).normal(size=problem.size))
    expected = plain(d)
    assert not linear._stiff
    monkeypatch.setattr(linear_problem, "STIFF_ROWS", 3)
    acting = {**kept, GROUND: kept[GROUND].copy()}
    judged = np.flatnonzero(problem.limits.judged)[5:9]
    acting[GROUND][judged, 0] = -1.0, -2.0, -4.0, -3.0
    solved = linear.precondition(locked, None, limits, acting)(d)
    assert set(linear._stiff) == {(GROUND, n, 0) for n in judged[1:]}
    rows = np.array([np.where(locked, 0.0, row) for row in linear._stiff.values()])
    weight = limits.curvature(GROUND, acting[GROUND])[judged[0], 0]
    plain = linear.precondition(locked, None, limits, kept)
    assert solved == pytest.approx(
        expected - plain(weight * rows.T @ (rows @ solved)), rel=1e-5
    )  # its diagonal is 1e-9 larger
