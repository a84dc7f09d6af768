"""Searches that avoid reversals of gears with play: what they save, what it costs, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain
from calmotion.errors import ShotError
from calmotion.model import Animation, Track
from calmotion.model.run import RunSettings
from calmotion.retargeting.avoided_reversals import refuse_without_play
from calmotion.retargeting.optimize import optimize_shot
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.motors.backlash import with_lost_motion
from posed import ignore_progress

FRAMES = np.arange(61) / 30.0
PLAY = np.radians(0.5)


def eased(first, last):
    s = FRAMES / FRAMES[-1]
    return first + (last - first) * (10 * s**3 - 15 * s**4 + 6 * s**5)


def searched(angles, weight):
    """Largest error of the curves [mm], reversals of the input and of the curves, and what play does to these [mm]."""
    character = chain(1, driven=(0,), length=0.6)
    character = replace(character, motors=tuple(replace(m, backlash=PLAY) for m in character.motors))
    track = Track(FRAMES, angles)
    shot = compile_shot(character, Animation(FRAMES, (track,), (track,)))
    options = RunSettings(step=1 / 240, tolerance=1e-5, avoid_reversals=weight)
    result = with_lost_motion(shot, optimize_shot(shot, options, ignore_progress), options)
    before, after = result.lost_motion
    error = 1e3 * result.after.position_errors.max()
    return error, len(before.reversals[0]), len(after.reversals[0]), 1e3 * after.largest_m[0]


def test_a_tremble_that_crosses_the_play_is_smoothed_for_some_millimetres():
    # a lift against gravity with a tremble of 3 degrees, whose torque changes its sign six times
    lift = eased(0.2, 1.3) + 0.05 * np.sin(20 * FRAMES) * np.sin(np.pi * FRAMES / 2) ** 2
    error, before, after, lost = searched(lift, 0.0)
    assert error < 1e-3 and before == after == 6 and lost == pytest.approx(5.24, abs=0.01)
    error, _, after, lost = searched(lift, 10.0)
    assert error < 5.0 and after == 0 and lost == 0.0


def test_a_reversal_that_cannot_be_avoided_is_left_alone():
    error, before, after, lost = searched(eased(1.2, 2.0), 10.0)  # past the lowest point: gravity turns the torque
    assert before == after == 1 and error < 1e-3 and lost == pytest.approx(5.24, abs=0.01)


def test_what_cannot_be_done_is_refused():
    character = chain(1, driven=(0,), length=0.6)
    options = RunSettings(avoid_reversals=1.0)
    with pytest.raises(ShotError, match="no motor has play"):
        refuse_without_play(character, options)
    refuse_without_play(character, RunSettings())
    character = replace(character, motors=tuple(replace(m, backlash=PLAY) for m in character.motors))
    refuse_without_play(character, options)
    with pytest.raises(ShotError, match="continuous adjoint"):
        refuse_without_play(character, replace(options, adjoint="continuous"))
