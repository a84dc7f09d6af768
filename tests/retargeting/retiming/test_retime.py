"""Tempo and offsets of a small flexible arm together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import MassProperties
from calmotion.model.curves import commanded_curves, held_curve
from calmotion.model.limits.use import LimitUse
from calmotion.model.result import Retimed
from calmotion.model.run import RunSettings
from calmotion.model.tempo import TempoSettings
from calmotion.retargeting.retiming.retime import optimize_with_tempo
from calmotion.retargeting.retiming.rigid_robot import tempo_input
from calmotion.retargeting.retiming.settings import pinned_times, refuse_tempo
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.retargeting.within_limits import told_between
from calmotion.simulation.bodies import with_elasticity
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.tolerance.simulation import found_tracks
from made_shots import reduced_shot
from posed import ignore_progress

OPTIONS = RunSettings(step=1 / 240)
RETIMED = replace(OPTIONS, retime=TempoSettings(slowest=4.0))


def limited(arm, animation, bodies, quantity, share):
    """The arm with limits of a quantity at a share of what the animation needs on rigid links."""
    end = animation.frame_times[-1]
    fine = np.linspace(0.0, end, 4001)
    orders = {"velocity": ("max_velocity", 1), "acceleration": ("max_acceleration", 2), "jerk": ("max_jerk", 3)}
    if quantity in orders:
        name, order = orders[quantity]
        needed = np.array([np.max(np.abs(held_curve(track, end)(fine, order))) for track in animation.tracks])
    else:
        name, motors = "max_torque", tuple(replace(motor, max_torque=1e9) for motor in arm.motors)
        weak = compile_shot(replace(arm, motors=motors), animation, bodies)
        efforts = tempo_input(weak, OPTIONS, animation.tracks).efforts
        needed = np.max(np.abs(efforts.at_rest), axis=0) + share * np.max(np.abs(efforts.by_square), axis=0)
        share = 1.0
    motors = [replace(m, **{name: v}) for m, v in zip(arm.motors, share * needed, strict=True)]
    return replace(arm, motors=tuple(motors))


def exceeded(shot, found, quantity):
    """The largest share of a limit by differences of fine samples of the curves, or in a simulation by finer steps."""
    performance = shot.at(found.retimed)
    motors, animation = performance.character.motors, performance.animation
    if quantity == "effort":
        finer = performance.with_tracks(found_tracks(found, animation))
        options = replace(OPTIONS, step=0.25 * found.step_s, integrator="newmark")
        run = simulate_shot(finer, options, ignore_progress).before.motion
        reached, largest = run.motor_efforts[run.judged], [motor.max_torque for motor in motors]
    else:
        order = ("velocity", "acceleration", "jerk").index(quantity) + 1
        times = np.linspace(0.0, animation.frame_times[-1], 8001)
        values = commanded_curves(performance.character, animation, found)(times, 0)
        reached = np.diff(values, order, axis=0) / (times[1] - times[0]) ** order
        largest = [getattr(motor, f"max_{quantity}") for motor in motors]
    return float(np.max(np.abs(reached) / largest))


def largest(result):
    run = result.after
    return float(run.position_errors[run.motion.judged].max())


def test_without_a_need_for_it_results_are_those_without_a_tempo(arm, animation, bodies):
    shot = compile_shot(limited(arm, animation, bodies, "velocity", 2.0), animation, bodies)
    plain = optimize_to_tolerance(shot, OPTIONS, ignore_progress)
    found = optimize_with_tempo(shot, RETIMED, ignore_progress)
    for one, other in zip(found.curves, plain.curves, strict=True):
        assert np.array_equal(one.frame_values, other.frame_values)
    assert found.objective_after == plain.objective_after
    assert found.retimed.animation.tempo is None and found.retimed.report.stretches == ()


@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk", "effort"])
def test_slower_motors_perform_the_animation_later_and_within_their_limits(arm, animation, bodies, quantity):
    shot = compile_shot(limited(arm, animation, bodies, quantity, 0.6), animation, bodies)
    at_full_tempo = largest(optimize_to_tolerance(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress))
    found = optimize_with_tempo(shot, RETIMED, ignore_progress)
    report, added = found.retimed.report, found.retimed.animation.tempo.added
    # the linear programme knows no jerks
    enough = 0.6 * report.uniform_added if quantity == "jerk" else 1.25 * report.lower_bound + 1 / 24
    assert report.lower_bound < added < enough
    assert exceeded(shot, found, quantity) <= 1.001
    assert largest(found) < max(1e-3, 1.2 * at_full_tempo)
    assert found.after.motion.times[-1] == pytest.approx(found.retimed.animation.frame_times[-1])


def test_limits_of_effort_hold_by_shorter_steps_than_that_of_the_search(arm, animation, bodies):
    """Positions that are right to the tolerance leave peaks of efforts some hundredths too low."""
    shot = compile_shot(limited(arm, animation, bodies, "effort", 0.8), animation, bodies)
    found = optimize_with_tempo(shot, replace(RETIMED, step=1 / 48), ignore_progress)
    assert exceeded(shot, found, "effort") <= 1.001


@pytest.mark.parametrize("share", [0.7, 0.75, 0.8])
def test_efforts_that_a_chosen_step_has_too_low_hold_by_finer_ones(arm, animation, bodies, share):
    shot = compile_shot(limited(arm, animation, bodies, "effort", share), animation, bodies)
    found = optimize_with_tempo(shot, replace(RETIMED, step=None, tolerance=5e-3), ignore_progress)
    assert exceeded(shot, found, "effort") <= 1.001
    assert found.search.stopped == "converged" and not any(use.excess > 1e-3 for use in found.limits)


@pytest.mark.parametrize("share", [0.7, 0.8])
def test_efforts_hold_by_finer_steps_at_the_full_tempo_as_well(arm, animation, bodies, share):
    shot = compile_shot(limited(arm, animation, bodies, "effort", share), animation, bodies)
    options, performed = replace(OPTIONS, step=None, tolerance=5e-3), Retimed(animation, shot.character, None)
    searched = optimize_to_tolerance(shot, options, ignore_progress)
    found = optimize_with_tempo(shot, options, ignore_progress)
    before, after = (exceeded(shot, replace(one, retimed=performed), "effort") for one in (searched, found))
    assert searched.search.stopped == "converged" and before > 1.005, "the search itself does not see it"
    assert after <= 1.001 and not any(use.excess > 1e-3 for use in found.limits)
    assert largest(found) < 1.01 * largest(searched)


def test_efforts_far_below_their_limits_cost_and_change_nothing(arm, animation, bodies, monkeypatch):
    shot = compile_shot(limited(arm, animation, bodies, "effort", 3.0), animation, bodies)
    monkeypatch.setattr("calmotion.retargeting.within_limits.efforts_by", None)
    plain = optimize_to_tolerance(shot, OPTIONS, ignore_progress)
    found = optimize_with_tempo(shot, OPTIONS, ignore_progress)
    assert all(np.array_equal(a.frame_values, b.frame_values) for a, b in zip(found.curves, plain.curves, strict=True))


def test_both_motions_have_the_elastic_coordinates_of_the_last_search(arm, animation, bodies, meshes):
    slow = with_elasticity(limited(arm, animation, bodies, "velocity", 0.6), "stvk")
    shot = reduced_shot(slow, animation, meshes, RunSettings(tolerance=1e-3))
    found = optimize_with_tempo(shot, replace(RETIMED, step=None, tolerance=1e-3), ignore_progress)
    before, after = ([u.shape for u in run.motion.elastic] for run in (found.before, found.after))
    assert before == after and before[0][1] < len(shot.bodies[0].stiffness)


@pytest.mark.parametrize("retime", [None, TempoSettings(slowest=1.5)])
def test_motors_that_are_far_too_slow_end_within_their_limits_as_near_as_on_rigid_links(arm, animation, bodies, retime):
    """A fifth of the speed that the animation needs: neither bent curves nor the largest stretch make up for it."""
    slow, options = limited(arm, animation, bodies, "velocity", 0.2), replace(OPTIONS, retime=retime)
    found = optimize_with_tempo(compile_shot(slow, animation, bodies), options, ignore_progress)
    mass = MassProperties(0.17, np.array([0.16, 0.0, 0.0]), 1e-3 * np.eye(3))
    links = tuple(replace(body, flexible=None, mass=body.mass or mass) for body in slow.bodies)
    forced = optimize_with_tempo(compile_shot(replace(slow, bodies=links), animation), options, ignore_progress)
    performed = found.retimed or Retimed(animation, slow, None)
    assert exceeded(compile_shot(slow, animation, bodies), replace(found, retimed=performed), "velocity") <= 1.001
    assert not any(use.excess > 1e-3 for use in found.limits)
    assert not found.improved and largest(found) > float(found.before.position_errors.max())
    assert largest(found) < 1.1 * largest(forced)


def test_what_curves_exceed_between_instants_is_told():
    rows = ((0, "velocity", -2.0, -2.0), (1, "velocity", 2.0, 2.0), (0, "position", 1.0, 0.5))
    uses = [LimitUse(m, name, limit, 1.0, after, 0.5, after / limit - 1.0) for m, name, limit, after in rows]
    first, second, third = told_between(uses, {"velocity": np.array([1.01, 1.0005])})
    assert first.after == pytest.approx(-2.02) and first.excess == pytest.approx(0.01)
    assert second is uses[1] and third is uses[2]


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
