"""What the regulariser holds back: commands of compliant motors less than curves of ideal ones."""

from dataclasses import replace

import numpy as np
from arms import chain
from calmotion.model import Animation, Track
from calmotion.model.motor import Rotor
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem import posing
from calmotion.retargeting.problem.posing import CLOSENESS, CLOSENESS_OF_COMMANDS, closeness_of
from calmotion.simulation.compiled_shot import compile_shot
from posed import ignore_progress

FRAMES = np.arange(61) / 60.0


def test_a_soft_servo_may_be_told_to_go_far_ahead(monkeypatch):
    character = chain(1, driven=(0,), length=0.3)
    assert closeness_of(character) == CLOSENESS
    rotor = Rotor(0.02, np.inf)
    soft = tuple(
        replace(m, model="servo", position_gain=60.0, velocity_gain=1.0, rotor=rotor) for m in character.motors
    )
    character = replace(character, motors=soft)
    assert closeness_of(character) == CLOSENESS_OF_COMMANDS
    track = Track(FRAMES, 0.4 * np.sin(7.0 * FRAMES))  # starts in motion: there is a pre-roll
    shot = compile_shot(character, Animation(FRAMES, (track,), (track,)))

    def share():
        result = optimize_shot(shot, RunSettings(step=1 / 240, tolerance=1e-5), ignore_progress)
        return result.after.position_errors.max() / result.before.position_errors.max()

    left = share()
    monkeypatch.setattr(posing, "CLOSENESS_OF_COMMANDS", CLOSENESS)
    held_back = share()
    assert left < 0.7 * held_back


def lagging(max_torque):
    """An arm on servos whose damping lets them lag by 0.1 s, which the torque that they have allows to make up for."""
    rotor = Rotor(0.0, np.inf, 0.0, 1.0, 0.1)
    gains = {"position_gain": 300.0, "velocity_gain": 30.0, "damping_on": "joint", "max_torque": max_torque}
    character = chain(2, driven=(0, 1), length=0.3)
    motors = tuple(replace(m, model="servo", rotor=rotor, **gains) for m in character.motors)
    wave = np.sin(np.pi * FRAMES) ** 4
    tracks = (Track(FRAMES, 0.9 * wave), Track(FRAMES, -1.2 * wave))
    return compile_shot(replace(character, motors=motors), Animation(FRAMES, tracks, tracks))


def test_a_search_begins_at_the_commands_of_the_rigid_robot():
    options = RunSettings(step=1 / 240, tolerance=1e-5)
    result = optimize_shot(lagging(40.0), options, ignore_progress)
    assert result.search.stopped == "converged" and result.search.iterations < 20
    assert result.search.steps[0].objective < 0.01 * result.objective_before
    assert result.after.position_errors.max() < 2e-3 * result.before.position_errors.max()
    still = optimize_shot(lagging(40.0), replace(options, max_iterations=0), ignore_progress)
    assert still.objective_after == still.objective_before, "no iteration, no change"


def heavy(rest):
    """A heavy arm on soft servos that is to keep the sag of its poses, with a rest before its motion [s]."""
    rotor = Rotor(0.0, np.inf, 0.0, 1.0, 0.1)
    gains = {"position_gain": 30.0, "velocity_gain": 3.0, "damping_on": "joint", "max_torque": 60.0}
    character = chain(2, driven=(0, 1), length=0.3)
    motors = tuple(replace(m, model="servo", rotor=rotor, **gains) for m in character.motors)
    character = replace(character, motors=motors, retarget=replace(character.retarget, reference="static"))
    times = np.arange(round(60 * (1.0 + rest)) + 1) / 60.0
    wave = np.sin(np.pi * np.clip(times - rest, 0.0, 1.0)) ** 4
    tracks = (Track(times, 0.4 + 0.9 * wave), Track(times, -1.2 * wave))
    return compile_shot(character, Animation(times, tracks, tracks))


def test_where_sag_is_kept_a_search_begins_without_it_however_long_the_rest_is():
    options = RunSettings(step=1 / 240, tolerance=1e-5)
    short, long = (optimize_shot(heavy(rest), options, ignore_progress) for rest in (0.0, 6.0))
    for result in (short, long):
        assert result.before.sag.max() > 0.05 and result.search.stopped == "converged"
        assert result.search.steps[0].objective < 0.2 * result.objective_before
        assert result.after.position_errors.max() < 5e-3 * result.before.position_errors.max()
