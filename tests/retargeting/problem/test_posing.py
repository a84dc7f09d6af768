"""What the regulariser holds back: commands of motors that give less than curves of ideal ones."""

from dataclasses import replace

import numpy as np
from arms import chain
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem import posing
from calmotion.retargeting.problem.posing import CLOSENESS, CLOSENESS_OF_COMMANDS, closeness_of
from calmotion.shot import Animation, Track
from calmotion.shot.motor import Rotor
from calmotion.shot.run import RunSettings
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
