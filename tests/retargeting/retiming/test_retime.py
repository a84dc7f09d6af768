"""Tempo and offsets of a small flexible arm together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model.curves import commanded_curves, held_curve
from calmotion.model.retiming.tempo import TempoSettings
from calmotion.model.run import RunSettings
from calmotion.retargeting.retiming.retime import optimize_with_tempo
from calmotion.retargeting.retiming.settings import pinned_times, refuse_tempo
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.simulation.compiled_shot import compile_shot
from posed import ignore_progress

OPTIONS = RunSettings(step=1 / 240)
RETIMED = replace(OPTIONS, retime=TempoSettings(slowest=4.0))


def slower_motors(arm, animation, share):
    """The arm with limits of speed at a share of what the animation needs."""
    end = animation.frame_times[-1]
    fine = np.linspace(0.0, end, 4001)
    fastest = [share * np.max(np.abs(held_curve(track, end)(fine, 1))) for track in animation.tracks]
    motors = [replace(m, max_velocity=v) for m, v in zip(arm.motors, fastest, strict=True)]
    return replace(arm, motors=tuple(motors))


def largest(result):
    run = result.after
    return float(run.position_errors[run.motion.judged].max())


def test_without_a_need_for_it_results_are_those_without_a_tempo(arm, animation, bodies):
    shot = compile_shot(slower_motors(arm, animation, 2.0), animation, bodies)
    plain = optimize_to_tolerance(shot, OPTIONS, ignore_progress)
    found = optimize_with_tempo(shot, RETIMED, ignore_progress)
    for one, other in zip(found.curves, plain.curves, strict=True):
        assert np.array_equal(one.frame_values, other.frame_values)
    assert found.objective_after == plain.objective_after
    assert found.retimed.animation.tempo is None and found.retimed.report.stretches == ()


def test_slower_motors_perform_the_animation_later_and_within_their_limits(arm, animation, bodies):
    slow = slower_motors(arm, animation, 0.6)
    shot = compile_shot(slow, animation, bodies)
    at_full_tempo = largest(optimize_to_tolerance(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress))
    found = optimize_with_tempo(shot, RETIMED, ignore_progress)
    performance = found.retimed.animation
    report, added = found.retimed.report, performance.tempo.added
    assert report.lower_bound < added < 1.25 * report.lower_bound + 1 / 24 < report.uniform_added
    # limits by differences of the curves, finer than the search knows them
    times = np.linspace(0.0, performance.frame_times[-1], 20001)
    values = commanded_curves(slow, performance, found)(times, 0)
    fastest = np.abs(np.diff(values, axis=0)).max(axis=0) / (times[1] - times[0])
    assert np.all(fastest <= 1.001 * np.array([motor.max_velocity for motor in slow.motors]))
    assert largest(found) < max(1e-3, 1.2 * at_full_tempo)
    assert found.after.motion.times[-1] == pytest.approx(performance.frame_times[-1])


def test_what_cannot_be_retimed_is_refused(arm, animation):
    loop = replace(arm, retarget=replace(arm.retarget, cyclic=True))
    for character, settings, what in (
        (loop, TempoSettings(), "loops"),
        (arm, TempoSettings(pinned=(-1.0, 0.5)), "outside"),
        (arm, TempoSettings(slowest=0.5), "out of range"),
        (arm, TempoSettings(fastest=1.5), "out of range"),
    ):
        with pytest.raises(ShotError, match=what):
            refuse_tempo(character, animation, settings)


def test_pinned_times_are_time_codes_or_seconds():
    assert pinned_times("48, 24,3s", 0.0, 24.0) == (1.0, 2.0, 3.0)
    assert pinned_times("25", 1.0, 24.0) == (1.0,)
    with pytest.raises(ShotError, match="neither a time code nor seconds"):
        pinned_times("24,beat", 0.0, 24.0)
