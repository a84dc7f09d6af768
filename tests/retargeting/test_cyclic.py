"""Shots that loop: judged in a steady state, optimised over it, without a jump at the seam."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model import Animation, FreeTrack, Track
from calmotion.model.run import RunSettings
from calmotion.multibody.model.topology import span_tree
from calmotion.multibody.sensitivity import periodic
from calmotion.retargeting.optimize import optimize_shot
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from posed import ignore_progress

OPTIONS = RunSettings(step=1 / 240)
FRAMES = np.arange(37) / 24.0


@pytest.fixture(scope="module")
def looping(arm):
    return dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, cyclic=True))


@pytest.fixture(scope="module")
def dance():
    """A loop of a second and a half that is nowhere at rest."""
    w = 2.0 * np.pi / FRAMES[-1]
    tracks = (Track(FRAMES, 0.5 * np.sin(w * FRAMES)), Track(FRAMES, 0.4 * np.cos(2.0 * w * FRAMES + 0.5)))
    return Animation(FRAMES, tracks, tracks)


@pytest.fixture(scope="module")
def result(looping, dance, bodies):
    return optimize_shot(compile_shot(looping, dance, bodies), OPTIONS, ignore_progress)


def test_a_cyclic_shot_has_no_shake_and_no_seam(result):
    before, after = (s.position_errors[:, 1].max() for s in (result.before, result.after))
    assert before > 0.01 and after < 0.15 * before
    assert result.objective_after < 0.1 * result.objective_before and result.search.stopped == "converged"
    assert result.before.seam.max() < 1e-8 and result.after.seam.max() < 1e-8
    # the instant before the loop is no part of the result
    assert result.after.motion.times[0] == 0.0 and len(result.after.motion.times) == 361
    assert np.abs(result.after.position_errors[0] - result.after.position_errors[-1]).max() < 1e-8
    assert result.pre_roll_s == 0.0 and not len(result.after.sag)
    for curve in result.curves:
        assert curve.changed and curve.frame_values[0] == pytest.approx(curve.frame_values[-1], abs=1e-12)


def test_written_curves_simulated_again_give_the_reported_errors(result, looping, dance, bodies):
    tracks = tuple(Track(FRAMES, curve.frame_values) for curve in result.curves)
    again = simulate_shot(
        compile_shot(looping, Animation(FRAMES, dance.tracks, tracks), bodies), OPTIONS, ignore_progress
    )
    assert np.abs(again.before.position_errors - result.after.position_errors).max() < 1e-8


def test_it_equals_the_motion_of_a_well_damped_robot_after_many_cycles(looping, dance, meshes):
    """Simulated from rest, eight loops long, as one shot that plays once."""
    plastic = dataclasses.replace(looping.bodies[0].flexible.material, damping_ratio=0.9)
    flexible = dataclasses.replace(looping.bodies[0].flexible, material=plastic)
    damped = tuple(dataclasses.replace(body, flexible=flexible) if body.flexible else body for body in looping.bodies)
    character = dataclasses.replace(looping, bodies=damped)
    bodies = reduce_bodies(character, span_tree(character), meshes)
    found = simulate_shot(compile_shot(character, dance, bodies), OPTIONS, ignore_progress)
    loops, frames = 8, len(FRAMES) - 1
    times = np.arange(loops * frames + 1) / 24.0
    tracks = tuple(
        Track(times, np.append(np.tile(track.values[:-1], loops), track.values[-1])) for track in dance.tracks
    )
    once = dataclasses.replace(character, retarget=dataclasses.replace(character.retarget, cyclic=False))
    long = simulate_shot(compile_shot(once, Animation(times, tracks, tracks), bodies), OPTIONS, ignore_progress)
    # the last loop but one: the interpolant of the last ends differently
    last = long.before.motion.target_positions[-721:-360]
    assert np.abs(last - found.before.motion.target_positions).max() < 1e-5
    assert np.abs(long.before.motion.target_positions[240:601] - found.before.motion.target_positions).max() > 1e-4


def test_options_that_do_not_fit_a_cyclic_shot_are_refused(looping, dance, bodies):
    with pytest.raises(ShotError, match="only bdf2 simulates") as error:
        simulate_shot(
            compile_shot(looping, dance, bodies), dataclasses.replace(OPTIONS, integrator="newmark"), ignore_progress
        )
    assert error.value.attribute == "--integrator"
    with pytest.raises(ShotError, match="has no pre-roll") as error:
        simulate_shot(compile_shot(looping, dance, bodies), dataclasses.replace(OPTIONS, pre_roll=0.5), ignore_progress)
    assert error.value.attribute == "--pre-roll"


def test_a_range_locked_at_the_seam_is_locked_on_both_sides_of_it(looping, dance, bodies):
    locks = (FreeTrack(np.array([0.0, 0.1]), np.array([False, True]), 0),)
    found = optimize_shot(
        compile_shot(looping, dataclasses.replace(dance, free=locks), bodies), OPTIONS, ignore_progress
    )
    values, meant = found.curves[0].frame_values, dance.tracks[0].values
    assert np.abs((values - meant)[[0, 1, 2, -1]]).max() < 1e-12 and np.abs(values - meant).max() > 1e-4


def test_a_cyclic_shot_that_does_not_close_is_refused(looping, dance, bodies):
    values = dance.tracks[1].values + np.linspace(0.0, 0.05, len(FRAMES))
    tracks = (dance.tracks[0], Track(FRAMES, values))
    with pytest.raises(ShotError, match="first and the last frame") as error:
        simulate_shot(compile_shot(looping, Animation(FRAMES, tracks, tracks), bodies), OPTIONS, ignore_progress)
    assert error.value.path == "/Arm/Elbow" and "2.86 degrees" in str(error.value) and error.value.remedy


def test_whole_revolutions_of_a_cyclic_shot_are_not_a_jump(looping, dance, bodies):
    """A shoulder that goes round and round; a shot that plays it once starts in motion."""
    w = 2.0 * np.pi / FRAMES[-1]
    tracks = (Track(FRAMES, w * FRAMES), dance.tracks[1])
    joints = (dataclasses.replace(looping.joints[0], lower=-np.inf, upper=np.inf), *looping.joints[1:])
    turning = dataclasses.replace(looping, joints=joints)
    found = simulate_shot(compile_shot(turning, Animation(FRAMES, tracks, tracks), bodies), OPTIONS, ignore_progress)
    assert found.before.seam.max() < 1e-3
    # the forearm feels the same pull all the way: its tip is off by the centrifugal stretch and the sway alone
    assert 1e-3 < found.before.position_errors[:, 1].max() < 0.2


def test_a_periodic_motion_that_is_not_found_has_a_remedy(looping, dance, bodies, monkeypatch):
    monkeypatch.setattr(periodic, "LIMIT", 1)
    for job in (simulate_shot, optimize_shot):
        with pytest.raises(ShotError, match="no periodic motion") as error:
            job(compile_shot(looping, dance, bodies), OPTIONS, ignore_progress)
        assert error.value.attribute == "calm:retarget:cyclic" and "calm:damping:ratio" in error.value.remedy
