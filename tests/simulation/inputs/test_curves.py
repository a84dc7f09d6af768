"""Tracks as smooth curves, played once and in a loop."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import Follows, Track
from calmotion.model.curves import curve_of, cycle_gap, cyclic_curve, interpolate
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem.posing import pose
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.curves import (
    CommandDelay,
    coupling_of,
    leaders,
    needed_pre_roll,
    sample_curves,
    sample_tracks,
)
from calmotion.simulation.inputs.time_grid import make_grid
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulate import intended_motion

FRAMES = np.arange(25) / 24.0


def test_pre_roll_is_only_for_shots_that_start_in_motion():
    still = np.where(FRAMES < 0.2, 0.0, (FRAMES - 0.2) ** 3)
    assert needed_pre_roll([Track(FRAMES, still)], FRAMES) == 0.0
    assert needed_pre_roll([Track(FRAMES, still), Track(FRAMES, 0.1 * FRAMES)], FRAMES) > 0.0


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6])
def test_sparse_tracks_are_interpolated_and_held(count):
    times = np.linspace(0.25, 0.75, count)
    values = np.linspace(1.0, 2.0, count)
    spline = interpolate(Track(times, values), FRAMES[-1])
    assert np.allclose(spline(times), values)
    angles, rates = sample_tracks([Track(times, values)], make_grid(FRAMES, None, 0.0))
    assert angles[0, 0] == pytest.approx(values[0]) and angles[-1, 0] == pytest.approx(values[-1])
    assert rates[0, 0] == 0.0 and rates[-1, 0] == 0.0


def test_a_cyclic_curve_is_smooth_at_its_seam_also_with_whole_revolutions():
    values = 0.3 * np.sin(2 * np.pi * FRAMES + 0.7) + 4 * np.pi * FRAMES
    curve = cyclic_curve(Track(FRAMES, values), FRAMES[-1])
    assert np.allclose(curve(FRAMES, 0), values)
    for order in range(3):
        before, after = curve(np.array([1.0 - 1e-9]), order), curve(np.array([1.0 + 1e-9]), order)
        assert np.abs(after - before) < 1e-5
    assert np.allclose(curve(FRAMES + 3.0, 0), values + 3 * 4 * np.pi)
    assert np.allclose(curve(FRAMES, 1), curve(FRAMES - 2.0, 1))


def test_sparse_samples_of_a_cyclic_shot_are_completed_at_its_ends():
    for times in (np.array([0.5]), np.array([0.25, 0.75]), np.array([-0.2, 0.4, 1.3])):
        track = Track(times, np.cos(2 * np.pi * times))
        curve = cyclic_curve(track, 1.0)
        inside = times[(times >= 0.0) & (times <= 1.0)]
        assert np.allclose(curve(inside, 0), np.cos(2 * np.pi * inside))
        assert np.allclose(curve(np.array([0.0]), 0), curve(np.array([1.0]), 0))


def test_chains_that_do_not_close_are_noticed():
    almost = Track(FRAMES, FRAMES * (2 * np.pi + 0.01))
    assert cycle_gap(almost, 1.0, turning=True) == pytest.approx(0.01)
    assert cycle_gap(almost, 1.0, turning=False) == pytest.approx(2 * np.pi + 0.01)


def test_a_corner_is_kept_and_the_rest_is_smooth():
    values = np.where(FRAMES < 0.5, FRAMES**2, 0.25 - 2.0 * (FRAMES - 0.5))
    curve = curve_of(Track(FRAMES, values, np.array([0.5])), 1.0, False)
    fine = np.linspace(0.0, 1.0, 501)
    assert np.allclose(curve(fine, 0), np.where(fine < 0.5, fine**2, 0.25 - 2.0 * (fine - 0.5)), atol=1e-12)
    assert curve(np.array([0.5 - 1e-9]), 1) == pytest.approx(1.0) and curve(np.array([0.5]), 1) == pytest.approx(-2.0)
    rounded = curve_of(Track(FRAMES, values), 1.0, False)
    assert np.abs(rounded(fine, 0) - curve(fine, 0)).max() > 1e-3, "without it the corner would be rounded"


def test_constant_parts_before_and_after_corners_are_at_rest():
    track = Track(np.array([0.25, 0.5, 0.75]), np.array([0.0, 1.0, 0.0]), np.array([0.5]))
    curve = curve_of(track, 1.0, False)
    assert np.allclose(curve(np.array([0.0, 0.1, 0.9, 1.0]), 1), 0.0)
    assert np.allclose(curve(track.times, 0), track.values)


def test_a_cyclic_curve_keeps_its_corners():
    values = np.abs(FRAMES - 0.5)
    curve = curve_of(Track(FRAMES, values, np.array([0.5])), 1.0, True)
    fine = np.linspace(0.3, 0.7, 201)
    assert np.allclose(curve(fine, 0), np.abs(fine - 0.5), atol=1e-3)
    assert np.allclose(curve(fine + 2.0, 0), curve(fine, 0))
    across = curve(np.array([1.0 - 1e-9, 1.0 + 1e-9]), 1)
    assert np.abs(np.diff(across)) < 1e-5, "its seam is no corner"


def test_a_shot_without_motors_has_no_curves():
    angles, rates = sample_tracks([], make_grid(FRAMES, None, 0.0))
    assert angles.shape == rates.shape == (len(make_grid(FRAMES, None, 0.0).times), 0)


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


H = 0.01


def test_cubics_are_shifted_exactly_and_rest_before_the_start():
    times, delay = H * np.arange(40), 0.0234
    cubic = np.polynomial.Polynomial([0.3, 0.0, 2.0, -4.0])
    values, rates = cubic(times)[:, None], cubic.deriv()(times)[:, None]
    found = CommandDelay((delay,), H, False).apply(values, rates)
    late = np.maximum(times - delay, 0.0)
    assert found[0][:, 0] == pytest.approx(cubic(late), abs=1e-14)
    assert found[1][:, 0] == pytest.approx(np.where(times < delay, 0.0, cubic.deriv()(late)), abs=1e-12)


def test_motors_have_their_own_delays_and_none_changes_nothing():
    rng = np.random.default_rng(0)
    values, rates = rng.normal(size=(2, 20, 3))
    found = CommandDelay((0.0, 0.02, 0.02), H, False).apply(values, rates)
    assert np.array_equal(found[0][:, 0], values[:, 0])
    assert found[0][2:, 1:] == pytest.approx(values[:-2, 1:]) and found[1][3:, 1:] == pytest.approx(rates[1:-2, 1:])
    assert CommandDelay((0.0, 0.0, 0.0), H, False).apply(values, rates)[0] is values


def test_a_loop_has_its_end_before_its_beginning():
    n = 50
    times = H * (np.arange(n + 2) - 1)
    w = 2 * np.pi / (n * H)
    found, _ = CommandDelay((0.013,), H, True).apply(np.sin(w * times)[:, None], w * np.cos(w * times)[:, None])
    assert found[:, 0] == pytest.approx(np.sin(w * (times - 0.013)), abs=1e-5)


@pytest.mark.parametrize("cyclic", [False, True])
def test_transpose(cyclic):
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 2, 30, 2))
    delay = CommandDelay((0.004, 0.031), H, cyclic)
    forward = sum(np.sum(x * y) for x, y in zip(delay.apply(*a), b, strict=True))
    backward = sum(np.sum(x * y) for x, y in zip(a, delay.transposed(*b), strict=True))
    assert forward == pytest.approx(backward, rel=1e-12)
