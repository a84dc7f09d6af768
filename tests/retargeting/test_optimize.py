"""The two jobs on a small arm: tenfold calmer, reproducible, within limits, honest about what it does not do."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model import Animation, FreeTrack, Track, WeightTrack
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.workflow.targets import goal_report, remaining_errors

OPTIONS = RunSettings(step=1 / 240)


def checked(fraction, message):
    assert 0.0 <= fraction <= 1.0 and message


@pytest.fixture(scope="module")
def progress():
    """The fractions and messages of the search of `result`."""
    return []


@pytest.fixture(scope="module")
def result(arm, animation, bodies, progress):
    return optimize_shot(compile_shot(arm, animation, bodies), OPTIONS, lambda *state: progress.append(state))


def test_the_sag_is_that_of_the_robot_not_that_of_the_curves(result):
    assert result.after.sag == pytest.approx(result.before.sag, rel=0.1) and result.before.sag.max() > 1e-5


def test_progress_rises_steadily_with_the_search(result, progress):
    fractions = [fraction for fraction, _ in progress]
    assert fractions == sorted(fractions) and 0.0 <= fractions[0] and fractions[-1] <= 1.0
    searched = [fraction for fraction, message in progress if message.startswith("optimising")]
    assert len(searched) >= 2 and len(set(searched)) == len(searched)
    assert all(message for _, message in progress)


def judged(simulation):
    return simulation.position_errors[simulation.motion.times >= 0.0].max(axis=0)


def test_error_at_the_payload_falls_at_least_tenfold(result):
    before, after = judged(result.before), judged(result.after)
    assert before[1] > 0.01, "the input should shake visibly"
    assert after[1] < 0.1 * before[1]
    assert result.objective_after < 0.03 * result.objective_before
    values = [step.objective for step in result.search.steps]
    assert all(b < a for a, b in zip(values, values[1:], strict=False))


def test_a_search_ends_at_its_goal_and_says_where_it_cannot_be_reached(result, arm, animation, bodies):
    shot, before = compile_shot(arm, animation, bodies), judged(result.before).max()
    near = optimize_shot(shot, dataclasses.replace(OPTIONS, goal=0.6 * before), checked)
    assert near.search.stopped == "goal reached" and judged(near.after).max() <= 0.6 * before
    assert near.search.forward_simulations < result.search.forward_simulations
    assert goal_report(arm, near) == {"goal_m": 0.6 * before, "goal_kept": True}
    of_shot = dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, goal=0.6 * before))
    assert optimize_shot(shot.with_character(of_shot), OPTIONS, checked).search.stopped == "goal reached"
    far = optimize_shot(shot, dataclasses.replace(OPTIONS, goal=1e-7), checked)
    assert far.search.stopped != "goal reached" and not goal_report(arm, far)["goal_kept"]
    assert judged(far.after)[1] <= 1.05 * judged(result.after)[1]
    missed = {row["path"] for row in remaining_errors(arm, far)}
    assert missed == {target.path for target, size in zip(arm.targets, judged(far.after), strict=True) if size > 1e-7}


def test_written_curves_simulated_again_give_the_reported_errors(result, arm, animation, bodies):
    tracks = tuple(Track(animation.frame_times, curve.frame_values) for curve in result.curves)
    again = simulate_shot(
        compile_shot(arm, Animation(animation.frame_times, animation.tracks, tracks), bodies), OPTIONS, checked
    )
    assert np.abs(again.before.position_errors - result.after.position_errors).max() < 1e-9
    assert np.abs(again.before.rotation_errors - result.after.rotation_errors).max() < 1e-8


def test_the_largest_offset_is_that_of_the_shot_without_the_pre_roll(arm, animation, bodies):
    """The shot starts in the middle of a move, and its pre-roll asks for the largest change."""
    first = len(animation.frame_times) // 3
    times = animation.frame_times[first:] - animation.frame_times[first]
    tracks = tuple(Track(times, track.values[first:]) for track in animation.tracks)
    moving = Animation(times, tracks, tracks)
    result = optimize_shot(compile_shot(arm, moving, bodies), dataclasses.replace(OPTIONS, max_iterations=2), checked)
    assert result.pre_roll_s > 0.0 and result.performed is not None
    motion = result.performed
    for curve in result.curves:
        frames = np.abs(curve.frame_values - tracks[curve.motor].values).max()
        assert frames <= curve.max_offset * (1 + 1e-9) and curve.max_offset < 1.2 * frames
    assert motion.times[0] < 0.0


def test_optimising_the_result_again_gains_nothing(result, arm, animation, bodies):
    tracks = tuple(Track(animation.frame_times, curve.frame_values) for curve in result.curves)
    again = optimize_shot(
        compile_shot(arm, Animation(animation.frame_times, animation.tracks, tracks), bodies), OPTIONS, checked
    )
    assert again.search.iterations <= 2
    assert again.objective_after <= result.objective_after * (1 + 1e-6)


def test_the_continuous_adjoint_leads_to_the_same_curves(result, arm, animation, bodies):
    found = optimize_shot(
        compile_shot(arm, animation, bodies), dataclasses.replace(OPTIONS, adjoint="continuous"), checked
    )
    assert found.objective_after < 1.02 * result.objective_after
    offsets = [a.frame_values - b.frame_values for a, b in zip(found.curves, result.curves, strict=True)]
    assert 0.0 < np.abs(offsets).max() < 0.05 * max(curve.max_offset for curve in result.curves)
    motors = tuple(dataclasses.replace(motor, max_torque=50.0) for motor in arm.motors)
    with pytest.raises(ShotError, match="efforts?") as error:
        limited = compile_shot(dataclasses.replace(arm, motors=motors), animation, bodies)
        optimize_shot(limited, dataclasses.replace(OPTIONS, adjoint="continuous"), checked)
    assert error.value.attribute == "retarget.optimize.adjoint" and "discrete" in error.value.remedy


def test_joints_stay_closed(result):
    assert max(result.before.max_joint_gap, result.after.max_joint_gap) < 1e-6


def test_locked_motors_keep_their_curves(arm, animation, bodies):
    motors = (dataclasses.replace(arm.motors[0], optimize=False), arm.motors[1])
    result = optimize_shot(compile_shot(dataclasses.replace(arm, motors=motors), animation, bodies), OPTIONS, checked)
    assert not result.curves[0].changed and result.curves[1].changed
    assert np.array_equal(result.after.motion.motor_values[:, 0], result.before.motion.motor_values[:, 0])
    assert any("/Arm/Shoulder" in row.what for row in result.left_out)


def test_a_range_in_which_a_motor_is_locked_keeps_its_curve(arm, animation, bodies):
    lock = FreeTrack(np.array([0.0, 0.5, 1.0]), np.array([True, False, True]), 0)
    result = optimize_shot(compile_shot(arm, dataclasses.replace(animation, free=(lock,)), bodies), OPTIONS, checked)
    before, after = result.before.motion, result.after.motion
    inside = (after.times >= 0.5) & (after.times <= 1.0)
    assert np.array_equal(after.motor_values[inside, 0], before.motor_values[inside, 0])
    assert np.abs(after.motor_values[~inside, 0] - before.motor_values[~inside, 0]).max() > 1e-4
    assert judged(result.after)[1] < judged(result.before)[1]
    with pytest.raises(ShotError, match="every motor is locked"):
        locks = tuple(FreeTrack(np.array([0.0]), np.array([False]), k) for k in range(2))
        optimize_shot(compile_shot(arm, dataclasses.replace(animation, free=locks), bodies), OPTIONS, checked)


def test_without_gain_the_curves_stay_exactly_the_same(arm, animation, bodies):
    """Nothing is judged in the second half."""
    weights = tuple(
        WeightTrack(target, rotation, np.array([0.7, 0.75]), np.array([value, 0.0]))
        for target, rotation, value in ((0, False, 1.0), (1, False, 1.0), (1, True, 0.05))
    )
    result = optimize_shot(compile_shot(arm, dataclasses.replace(animation, weights=weights), bodies), OPTIONS, checked)
    late = animation.frame_times > 1.2
    for curve, track in zip(result.curves, animation.tracks, strict=True):
        assert curve.changed and np.array_equal(curve.frame_values[late], track.values[late])
    first = (result.after.motion.times >= 0.0) & (result.after.motion.times < 0.7)
    before, after = (s.position_errors[first, 1].max() for s in (result.before, result.after))
    assert after < 0.1 * before


def test_a_static_reference_keeps_the_sag_and_removes_the_shake(arm, animation, bodies, result):
    character = dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, reference="static"))
    found = optimize_shot(compile_shot(character, animation, bodies), OPTIONS, checked)
    assert found.before.position_errors[0].max() < 1e-9, "at rest there is nothing to correct"
    sag = result.before.position_errors[0, 1]
    assert sag > 1e-3
    assert judged(found.after)[1] < 0.1 * judged(found.before)[1]
    # the first pose is the animator's, sag and all
    shift = found.after.motion.target_positions[0, 1] - result.reference.target_positions[0, 1]
    assert np.linalg.norm(shift) == pytest.approx(sag, rel=0.2)


def test_kept_ends_keep_the_first_and_last_pose(arm, animation, bodies):
    character = dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, endpoints="kept"))
    result = optimize_shot(compile_shot(character, animation, bodies), OPTIONS, checked)
    for curve, track in zip(result.curves, animation.tracks, strict=True):
        assert curve.frame_values[0] == track.values[0] and curve.frame_values[-1] == track.values[-1]
    # the sag of the first pose cannot be removed then
    assert judged(result.after)[1] >= 0.999 * result.before.position_errors[0, 1]
