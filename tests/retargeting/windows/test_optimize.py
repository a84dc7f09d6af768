"""A search in windows: equal to one long search, resumed behind windows that are done, edited only where touched."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import FreeTrack, Track
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.windows.optimize import optimize_windows
from calmotion.retargeting.windows.store import windows_path
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from long_moves import animation_of, long_moves

TOLERANCE = 1e-3
# The searches end where they would gain a thousandth of the tolerance, so that what is compared is what windows cost.
OPTIONS = RunSettings(step=1 / 120, tolerance=TOLERANCE / 100, knot_spacing=1 / 12)
SECONDS, LENGTH = 6.0, 3.0


def quiet(fraction, message):
    assert 0.0 <= fraction <= 1.0 and message


def shot_of(arm, animation, bodies):
    return compile_shot(arm, animation, bodies)


@pytest.fixture(scope="module")
def show(arm, bodies):
    return shot_of(arm, long_moves(SECONDS), bodies)


@pytest.fixture(scope="module")
def progress():
    return []


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    return windows_path(str(tmp_path_factory.mktemp("windows") / "calm.usda"))


@pytest.fixture(scope="module")
def result(show, progress, stored):
    return optimize_windows(show, OPTIONS, LENGTH, lambda *state: progress.append(state), stored=stored)


def test_windows_equal_one_long_search_within_a_tenth_of_the_tolerance(show, result):
    one = optimize_shot(show, OPTIONS, quiet)
    judged = one.after.motion.judged
    apart = one.after.motion.target_positions - result.after.motion.target_positions
    assert np.linalg.norm(apart, axis=2)[judged].max() < 0.1 * TOLERANCE
    profile = one.after.position_errors - result.after.position_errors
    assert np.abs(profile[judged]).max() < 0.1 * TOLERANCE
    assert result.objective_after == pytest.approx(one.objective_after, rel=1e-3)
    np.testing.assert_allclose(one.before.position_errors, result.before.position_errors, atol=1e-9)
    np.testing.assert_allclose(one.before.motion.motor_efforts, result.before.motion.motor_efforts, atol=1e-6)
    assert result.objective_before == pytest.approx(one.objective_before, rel=1e-9)


def test_each_window_goes_on_where_the_last_one_was_kept(result, progress):
    rows = result.windows
    assert [(row.start_s, row.kept_s, row.end_s) for row in rows] == [(0.0, 3.0, 4.5), (3.0, 6.0, 6.0)]
    assert all(row.searched and row.iterations and row.wall_s > 0.0 for row in rows)
    fractions = [fraction for fraction, _ in progress]
    assert fractions == sorted(fractions) and any("window 2 of 2" in message for _, message in progress)


def test_written_curves_simulated_again_give_the_reported_errors(result, show):
    tracks = [Track(show.animation.frame_times, curve.frame_values) for curve in result.curves]
    again = simulate_shot(show.with_tracks(tracks), OPTIONS, quiet)
    assert np.abs(again.before.position_errors - result.after.position_errors).max() < 1e-8
    knots = [curve.knots for curve in result.curves]
    assert all(np.isin(np.round(one, 9), np.round(show.animation.frame_times, 9)).all() for one in knots)
    assert all(len(one) < len(show.animation.frame_times) for one in knots)


def test_a_search_that_is_repeated_keeps_all_windows(result, show, stored):
    again = optimize_windows(show, OPTIONS, LENGTH, quiet, stored=stored)
    assert [row.searched for row in again.windows] == [False, False] and again.iterations == 0
    for one, two in zip(result.curves, again.curves, strict=True):
        np.testing.assert_array_equal(one.frame_values, two.frame_values)
    np.testing.assert_allclose(again.after.position_errors, result.after.position_errors, atol=1e-12)


def test_an_interrupted_search_goes_on_behind_the_windows_that_are_done(result, show, tmp_path):
    stored = windows_path(str(tmp_path / "calm.usda"))

    def interrupt(fraction, message):
        if message.startswith("window 2") and "optimising" in message:
            raise KeyboardInterrupt

    early = optimize_windows(show, OPTIONS, LENGTH, interrupt, stored=stored)
    assert early.interrupted and early.stopped == "interrupted" and len(early.windows) == 2
    assert early.after.position_errors.shape == early.before.position_errors.shape
    late = optimize_windows(show, OPTIONS, LENGTH, quiet, stored=stored)
    assert [row.searched for row in late.windows] == [False, True] and not late.interrupted
    for one, two in zip(result.curves, late.curves, strict=True):
        np.testing.assert_array_equal(one.frame_values, two.frame_values)


def test_an_edit_is_searched_again_only_in_the_windows_that_it_touches(result, show, stored, arm, bodies):
    times = show.animation.frame_times
    values = [track.values.copy() for track in show.animation.tracks]
    values[0] += 0.1 * np.exp(-(((times - 1.0) / 0.15) ** 2)) * (np.abs(times - 1.0) < 0.8)
    edited = shot_of(arm, animation_of(times, values), bodies)
    kept = stored.read_bytes()
    again = optimize_windows(edited, OPTIONS, LENGTH, quiet, stored=stored)
    stored.write_bytes(kept)
    assert [row.searched for row in again.windows] == [True, False]
    late = times >= again.windows[0].end_s
    for one, two, before, after in zip(
        result.curves, again.curves, show.animation.tracks, edited.animation.tracks, strict=True
    ):
        offsets = one.frame_values - before.values, two.frame_values - after.values
        np.testing.assert_allclose(offsets[0][late], offsets[1][late], atol=1e-12)
    judged, errors = again.after.motion.judged, again.after.position_errors
    assert errors[judged].max() < 1.3 * result.after.position_errors[judged].max()


def test_motors_keep_locks_and_limits_in_windows(arm, bodies):
    motors = tuple(dataclasses.replace(motor, max_velocity=3.0) for motor in arm.motors)
    limited = dataclasses.replace(arm, motors=motors)
    animation = long_moves(4.0)
    free = (FreeTrack(1, np.array([0.0, 1.75, 2.5]), np.array([True, False, True])),)
    shot = compile_shot(limited, dataclasses.replace(animation, free=free), bodies)
    found = optimize_windows(shot, dataclasses.replace(OPTIONS, tolerance=TOLERANCE), 2.0, quiet)
    inside = (animation.frame_times >= 1.75) & (animation.frame_times <= 2.5)
    np.testing.assert_array_equal(found.curves[1].frame_values[inside], animation.tracks[1].values[inside])
    assert found.curves[1].changed and found.objective_after < found.objective_before
    assert max(use.excess for use in found.limits) < 1e-3
