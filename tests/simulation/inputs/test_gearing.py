"""Motors that are geared to others: one unknown moves several."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from calmotion.model import Follows, Track
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem.posing import pose
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.curves import coupling_of, leaders, sample_curves
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulate import intended_motion

RATIO = -0.6


@pytest.fixture
def geared(arm, animation):
    """The arm with its second motor geared to the first, and an animation that agrees."""
    first, second, *rest = arm.motors
    second = dataclasses.replace(second, follows=Follows(0, RATIO, 0.1))
    led = animation.tracks[0]
    tracks = (led, Track(led.times, 0.1 + RATIO * led.values), *animation.tracks[2:])
    return (
        dataclasses.replace(arm, motors=(first, second, *rest)),
        dataclasses.replace(animation, tracks=tracks, current=tracks),
    )


def problem_of(character, animation, bodies):
    options = RunSettings(step=1 / 240, pre_roll=0.0)
    prepared = prepare(compile_shot(character, animation, bodies), options)
    curves = sample_curves(animation.tracks, prepared.grid)
    return pose(prepared, curves, intended_motion(prepared, curves.angles, curves.rates), options)[0]


def test_followers_have_no_unknowns(geared):
    character, _ = geared
    assert 1 not in leaders(character) and 0 in leaders(character)
    coupling = coupling_of(character, leaders(character))
    assert coupling[0, 0] == 1.0 and coupling[1, 0] == RATIO


def test_a_locked_leader_locks_its_followers(geared):
    character, _ = geared
    locked = dataclasses.replace(character.motors[0], optimize=False)
    character = dataclasses.replace(character, motors=(locked, *character.motors[1:]))
    assert not np.any(coupling_of(character, leaders(character))[:2])


def test_the_gradient_is_that_of_the_motors_together(geared, bodies):
    character, animation = geared
    problem = problem_of(character, animation, bodies)
    rng = np.random.default_rng(1)
    x, way = 1e-3 * rng.standard_normal(problem.size), rng.standard_normal(problem.size)
    slope = problem.at(x).linearized().gradient @ way
    eps = 1e-5
    ahead, behind = (problem.at(x + s * eps * way).merit for s in (1.0, -1.0))
    assert slope == pytest.approx((ahead - behind) / (2 * eps), rel=1e-6)


def test_a_product_is_symmetric(geared, bodies):
    character, animation = geared
    problem = problem_of(character, animation, bodies)
    rng = np.random.default_rng(2)
    linear = problem.at(np.zeros(problem.size)).linearized()
    a, b = rng.standard_normal((2, problem.size))
    assert a @ linear.product(b) == pytest.approx(b @ linear.product(a), rel=1e-9)


def test_the_optimised_curves_stay_geared(geared, bodies):
    character, animation = geared
    result = optimize_shot(compile_shot(character, animation, bodies), RunSettings(step=1 / 240), lambda *_: None)
    led, follower = result.curves[0], result.curves[1]
    assert led.changed and follower.changed
    assert np.allclose(follower.frame_values, 0.1 + RATIO * led.frame_values, atol=1e-9)
    assert result.after.position_errors.max() < 0.5 * result.before.position_errors.max()
