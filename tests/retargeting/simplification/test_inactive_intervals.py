"""Inactive intervals: detected before the search, kept unchanged, and searched after all if that gains enough."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import Animation, FreeTrack, Track
from calmotion.model.budget import SEARCH_SHARE
from calmotion.model.run import RunSettings
from calmotion.retargeting import search
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem import adaptive_knots
from calmotion.retargeting.problem.offset_basis import basis_on
from calmotion.retargeting.search import MISSED, RetargetSearch
from calmotion.retargeting.simplification.inactive_intervals import (
    InactiveInterval,
    first_change,
    inactive_coefficients,
    inactive_intervals,
)
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulator import Simulator
from posed import ignore_progress, jerking, looped, make_problem

TOLERANCE = 2e-4  # so small that searches end at the same optimum
OPTIONS = RunSettings(step=1 / 240, tolerance=TOLERANCE)
HELD, MOVE = 1.5, 0.9


def ease(times, start, length):
    s = np.clip((times - start) / length, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def still(arm):
    """The arm with the sag of its poses wanted: at rest there is nothing to correct."""
    return dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, reference="static"))


def pausing(before=HELD, after=0.6):
    """A pose that is held, two fast moves, and the last pose held."""
    times = np.arange(round(24 * (before + MOVE + after)) + 1) / 24.0
    shoulder = 0.4 - 0.9 * ease(times, before, 0.4) + 0.7 * ease(times, before + 0.5, 0.4)
    elbow = 0.6 * ease(times, before + 0.05, 0.4) - 0.8 * ease(times, before + 0.55, 0.35)
    tracks = (Track(times, shoulder), Track(times, elbow))
    return Animation(times, tracks, tracks)


def rows_of(result):
    return [row for row in result.left_out if row.what.startswith("inactive interval from")]


def largest(simulation):
    return simulation.position_errors.max(axis=0)


def root_mean_square(result):
    return np.sqrt(np.mean(result.after.position_errors[:, 1] ** 2))


@pytest.fixture(scope="module")
def everywhere(arm, bodies):
    return optimize_shot(
        compile_shot(still(arm), pausing(), bodies), dataclasses.replace(OPTIONS, ranges="on"), ignore_progress
    )


def test_an_inactive_interval_before_a_move_is_skipped_without_loss(arm, bodies, everywhere, monkeypatch):
    simulated, run = [], Simulator.run

    def counted(self, angles, rates, near=None):
        motion = run(self, angles, rates, near)
        if self.model.system.size > 6:
            simulated.append(motion.trajectory)
        return motion

    monkeypatch.setattr(Simulator, "run", counted)
    result = optimize_shot(compile_shot(still(arm), pausing(), bodies), OPTIONS, ignore_progress)
    assert not rows_of(everywhere)
    (row,) = rows_of(result)
    assert row.what.startswith("inactive interval from 0 s to 1.") and "almost nothing" in row.why
    assert 0.0 < row.estimated_error_m < MISSED * SEARCH_SHARE * TOLERANCE
    until = float(row.what.split()[-2])
    assert until > HELD - 0.6, "a quarter of the hold may be needed to prepare the move"
    assert largest(everywhere.before)[1] > 8.0 * largest(everywhere.after)[1]
    assert abs(root_mean_square(result) - root_mean_square(everywhere)) < 0.02 * TOLERANCE
    early = pausing().frame_times <= until
    for curve, track in zip(result.curves, pausing().tracks, strict=True):
        assert curve.changed and np.array_equal(curve.frame_values[early], track.values[early])
    # the first and the last are whole simulations, those between share their beginning
    assert len({trajectory.states.c[: int(240 * until)].tobytes() for trajectory in simulated}) == 1
    assert simulated[-1].newton_iterations == result.after.newton_iterations


@pytest.mark.parametrize("locked", [False, True])
def test_with_an_early_error_no_interval_is_inactive_and_the_result_is_the_same(arm, bodies, monkeypatch, locked):
    """The rigid robot does not sag, and the first pose is to be its; where it is locked it is simulated once."""
    animation, firsts, held = pausing(0.8, 0.2), [], RetargetSearch._held
    if locked:
        locks = tuple(FreeTrack(k, np.array([0.0, 0.52]), np.array([False, True])) for k in range(2))
        animation = dataclasses.replace(animation, free=locks)
    with monkeypatch.context() as patch:
        patch.setattr(RetargetSearch, "_held", lambda self, first: (firsts.append(first), held(self, first)))
        result = optimize_shot(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress)
    assert not rows_of(result) and (max(firsts) > 0.5 * 240) == locked
    if not locked:
        assert result.after.position_errors[0, 1] < 0.5 * result.before.position_errors[0, 1]
    with monkeypatch.context() as patch:
        patch.setattr(RetargetSearch, "_held", lambda self, first: None)
        patch.setattr(search, "inactive_intervals", lambda *a: ())
        plain = optimize_shot(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress)
    for one, other in zip(result.curves, plain.curves, strict=True):
        assert np.array_equal(one.frame_values, other.frame_values)
    assert result.objective_after == plain.objective_after
    for one, other in zip(result.steps, plain.steps, strict=True):
        assert dataclasses.astuple(one)[0::2] == dataclasses.astuple(other)[0::2]


def test_inactive_intervals_stay_inactive_on_finer_knots(arm, bodies, monkeypatch):
    monkeypatch.setattr(adaptive_knots, "FIRST", 0.1)
    slow = jerking(0.9)
    times = np.arange(len(slow.frame_times) + 90) / 120.0
    tracks = tuple(Track(times, np.interp(times - 0.75, k.times, k.values)) for k in slow.tracks)
    first = make_problem(arm, bodies, Animation(times, tracks, tracks)).size
    result = optimize_shot(compile_shot(still(arm), Animation(times, tracks, tracks), bodies), OPTIONS, ignore_progress)
    (row,) = rows_of(result)
    before, after = result.before.motion, result.after.motion
    early = after.times <= float(row.what.split()[-2])
    assert np.count_nonzero(early) > 40 and result.parameters > first
    assert np.array_equal(after.motor_values[early], before.motor_values[early])
    assert all(curve.changed for curve in result.curves)


def test_a_range_that_would_have_gained_something_is_searched_after_all(arm, bodies, everywhere, monkeypatch):
    too_much = (InactiveInterval(0.0, HELD + 0.45, 0.0),)
    monkeypatch.setattr(search, "inactive_intervals", lambda *a: too_much)
    result = optimize_shot(compile_shot(still(arm), pausing(), bodies), OPTIONS, ignore_progress)
    assert not rows_of(result) and result.stopped == "converged"
    # each of the searches leaves a gain of a tenth of the tolerance
    assert abs(root_mean_square(result) - root_mean_square(everywhere)) < 0.2 * TOLERANCE
    assert result.gradients > everywhere.gradients
    # as it would stay without that
    monkeypatch.setattr(search, "MISSED", 1e9)
    worse = optimize_shot(compile_shot(still(arm), pausing(), bodies), OPTIONS, ignore_progress)
    (row,) = rows_of(worse)
    lost = root_mean_square(worse) - root_mean_square(result)
    assert lost > 1e-3 and 0.05 * lost < row.estimated_error_m < 2.0 * lost


def test_ranges_keep_away_from_errors_limits_and_changes(arm, bodies):
    def intervals_of(character, start=None, ranges="auto", animation=None):
        problem = make_problem(character, bodies, animation or pausing(after=3.0), static=True, limited=True)
        start = np.zeros(problem.size) if start is None else start(problem)
        return inactive_intervals(problem.at(np.zeros(problem.size)), start, 5.0, 1e-3, ranges)

    first, *others = intervals_of(arm)
    assert first.start == 0.0 and HELD - 0.6 < first.stop < HELD - 0.2 and 0.0 <= first.gain < 2e-6
    assert all(item.start > HELD + MOVE for item in others)
    assert intervals_of(arm, ranges="on") == ()

    def early(problem):
        return np.repeat(1e-3 * (problem.space.basis.support[:, 1] < 0.5), 2)

    changed, *_ = intervals_of(arm, early)
    assert 0.3 < changed.start < 0.8 and changed.stop == first.stop
    # the shoulder may not be where it is held
    tight = tuple(dataclasses.replace(j, upper=0.3) if j.upper else j for j in arm.joints)
    assert all(item.start > HELD for item in intervals_of(dataclasses.replace(arm, joints=tight)))
    loop = looped(arm, pausing())
    assert intervals_of(loop[0], animation=loop[1]) == ()


def test_a_shot_without_active_intervals_and_one_without_vibration(arm, bodies):
    times = np.arange(49) / 24.0
    tracks = (Track(times, 0.2 + 0.0 * times), Track(times, 0.0 * times))
    problem = make_problem(arm, bodies, Animation(times, tracks, tracks), static=True)
    zero = np.zeros(problem.size)
    assert inactive_intervals(problem.at(zero), zero, 5.0, 1e-3) == (), "a search of it ends at once"
    problem = make_problem(arm, bodies, pausing(), static=True)
    zero = np.zeros(problem.size)
    assert inactive_intervals(problem.at(zero), zero, 0.0, 1e-3) == ()


def test_finer_knots_before_the_first_change_have_no_effect(arm, bodies):
    problem = make_problem(arm, bodies, pausing(), pre_roll=0.2)
    grid, basis = problem.grid, basis_on(problem.grid, np.arange(0, 73, 6), False)

    def fixed_on(until):
        return lambda some: inactive_coefficients(some, (InactiveInterval(0.0, until, 0.0),), 2)

    assert first_change(grid, basis, lambda some: np.zeros(2 * some.count, bool)) == 0
    for until in (0.1, 0.5, 0.6, 0.75):
        first = first_change(grid, basis, fixed_on(until))
        for breaks in (basis.breaks, np.arange(0, 73, 3)):
            some = basis_on(grid, breaks, False)
            free = ~fixed_on(until)(some)[::2]
            assert not np.any(some.values[:first][:, free].toarray()) and np.any(free)
        assert grid.times[first] > until - 2 * grid.h
    assert first_change(grid, basis, fixed_on(9.0)) == len(grid.times) - 2
