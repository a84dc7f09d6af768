"""Clocks of recordings: that at which the robot of the shot is like them, where there is one."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain
from calmotion.model import Animation, Rotor, RunSettings, Track
from calmotion.model.animation import Schedule
from calmotion.recordings import ANGLE, Channel, SensorRecording
from calmotion.simulation.compiled_shot import compile_shot
from calmotion_plugins.calibration import CalibrationSettings, calibrate_shot, robot_with, signals_of
from calmotion_plugins.calibration.identification.recordings.clocks import clock_of

FRAMES = np.arange(193) / 48.0
DROPPED = Schedule(np.array([0.0, 1.2]), np.array([True, False]))


def dropped(friction):
    """A servo that lifts a pendulum, and lets it fall."""
    arm = chain(1, driven=(0,), length=0.12, mass=1.1)
    lift = -np.pi / 2 * np.sin(np.pi / 2 * np.clip(FRAMES, 0.0, 1.0)) ** 2 + np.pi / 2
    rotor = Rotor(0.02, friction=friction, viscous_friction=0.3 * friction)
    gains = {"model": "servo", "position_gain": 25.0, "max_torque": 5.0, "rotor": rotor, "powered": DROPPED}
    arm = replace(arm, motors=(replace(arm.motors[0], **gains),))
    tracks = (Track(FRAMES, lift),)
    return compile_shot(arm, Animation(FRAMES, tracks, tracks), None)


def signals(shot):
    return signals_of(robot_with(shot, {}), RunSettings(step=4e-3, integrator="bdf2"))


def recording(begin=0.0):
    times = np.arange(0.05, 3.95, 0.02)
    angles = signals(dropped(0.4)).at(ANGLE, 0, times)
    return SensorRecording("a.csv", "", (Channel(ANGLE, "/C/J0", times + begin, angles),))


def test_a_robot_that_is_like_the_recording_tells_its_clock():
    shot = dropped(0.3)
    assert clock_of(recording(5.0), shot.character, [signals(shot)]) == pytest.approx(5.0, abs=0.05)


def test_one_that_is_like_it_nowhere_tells_none_and_the_note_asks_for_friction():
    shot = dropped(0.0)
    assert clock_of(recording(), shot.character, [signals(shot)]) == 0.0
    assert clock_of(recording(5.0), shot.character, [signals(shot)]) != 0.0
    found = calibrate_shot(shot, [recording()], CalibrationSettings(("armature",)), RunSettings(step=4e-3))
    assert any("no friction of /C/J0" in note for note in found.notes)
