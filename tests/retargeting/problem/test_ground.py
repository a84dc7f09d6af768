"""Limits of what feet ask of the ground: their values against the report of feet, their derivatives against
differences."""

from __future__ import annotations

import calmotion as cm
import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.retargeting.kept_feet import keep_feet
from calmotion.retargeting.problem import ground
from calmotion.retargeting.problem.ground import GROUND, SPEED, ground_bounds, with_ground_rows
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.posing import locked_coefficients, pose
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.motor_limits import Bounds
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
    problem.value(start)
    keep_feet(found, problem)
    locked = locked_coefficients(shot.animation, problem.space.basis, problem.space.motors, problem.grid.end)
    return path, problem, start, locked


def test_values_are_those_of_the_report(posed):
    path, problem, start, _ = posed
    problem.value(start)
    limits, values = problem.robots[0].ground, problem.limited[GROUND]
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
    problem.limits.on = True
    problem.value(x)
    problem.linearize()
    residuals, changes = problem.jvp(direction)
    pulls = rng.standard_normal(changes[GROUND].shape)
    back = problem.vjp(np.zeros_like(residuals), {GROUND: pulls})
    assert back @ direction == pytest.approx(float(np.sum(pulls * changes[GROUND])), rel=1e-9)
    eps, sides = 1e-6, []
    for sign in (1.0, -1.0):
        problem.value(x + sign * eps * direction)
        sides.append(problem.limited[GROUND].copy())
    differences = (sides[0] - sides[1]) / (2.0 * eps)
    assert np.abs(differences - changes[GROUND]).max() < 1e-6 * np.abs(differences).max()
    moving = np.abs(differences).max(axis=0) > 0.0
    assert np.count_nonzero(~moving) == 1 and not moving[-2]  # no motor moves a foot sideways


def test_bounds_let_landings_be_as_fast_as_animated(posed):
    _, problem, _, _ = posed
    limits = problem.robots[0].ground
    bounds = ground_bounds(limits)
    assert np.all(bounds.upper[-3:] == limits.landings[0].speeds / SPEED) and np.all(np.isinf(bounds.upper[:-3]))


def limits_of(columns):
    """Limits of feet from zero up, and of a motor's position, at four instants of a tenth of a second."""
    ground = Bounds(np.zeros(columns), np.full(columns, np.inf), np.ones(columns))
    motor = Bounds(np.array([-1.0]), np.array([1.0]), np.ones(1))
    return LimitTerms({"position": motor, "ground": ground}, np.ones(4, bool), 0.1, 50.0, on=True)


def test_rows_that_act_are_part_of_the_inverse_and_worked_out_once():
    rng, limits = np.random.default_rng(0), limits_of(2)
    J, fixed, asked = rng.normal(size=(4, 2, 6)), np.arange(6) == 3, []
    values = {"position": np.full((4, 1), 3.0), "ground": np.ones((4, 2))}
    values["ground"][[1, 3], [0, 1]] = -0.2

    def pull(pulls):
        asked.append(pulls)
        return np.einsum("nr,nrx->x", pulls["ground"], J)

    known = {}
    solve = with_ground_rows(lambda x: x, limits, values, fixed, known, pull)
    rows = np.where(fixed, 0.0, J[[1, 3], [0, 1]])
    whole = np.eye(6) + 50.0 * 0.1 * rows.T @ rows
    assert np.allclose(solve(np.ones(6)), np.linalg.solve(whole, np.ones(6)))
    with_ground_rows(lambda x: x, limits, values, fixed, known, pull)
    assert len(asked) == 2 and set(known) == {("ground", 1, 0), ("ground", 3, 1)}


def test_of_many_rows_those_that_pull_most_are_taken(monkeypatch):
    monkeypatch.setattr(ground, "MOST", 1)
    values = {"ground": -np.arange(1.0, 9.0).reshape(4, 2)}
    known = {}
    with_ground_rows(lambda x: x, limits_of(2), values, np.zeros(3, bool), known, lambda pulls: np.ones(3))
    assert set(known) == {("ground", 3, 1)}


def test_without_limits_that_act_the_inverse_stays():
    values = {"ground": -np.ones((4, 2))}
    assert with_ground_rows(np.negative, None, values, np.zeros(3, bool), {}, np.sum) is np.negative
