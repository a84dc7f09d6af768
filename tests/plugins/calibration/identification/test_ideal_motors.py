"""Rotors of ideal motors, from their efforts: the motion is that of the shot, whatever they are."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain
from calmotion.model import Animation, RunSettings, Track
from calmotion.model.motor import Rotor
from calmotion.recordings import ANGLE, EFFORT, Channel, SensorRecording
from calmotion.simulation.compiled_shot import compile_shot
from calmotion_plugins.calibration import CalibrationSettings, calibrate_shot, robot_parameters
from scipy.interpolate import CubicSpline

MASS, LENGTH, G = 0.8, 0.4, 9.81
GUESSED, REAL = Rotor(0.02, friction=0.3, viscous_friction=0.1), Rotor(0.05, friction=0.5, viscous_friction=0.06)
FRAMES = np.arange(145) / 48.0
CURVE = 0.9 * np.sin(np.pi * FRAMES / 3.0) ** 4 * np.cos(8.0 * FRAMES)


def shot():
    arm = chain(1, driven=(0,), length=LENGTH, mass=MASS)
    arm = replace(arm, motors=(replace(arm.motors[0], rotor=GUESSED),))
    tracks = (Track(FRAMES, CURVE),)
    return compile_shot(arm, Animation(FRAMES, tracks, tracks), None)


def recording(*kinds, noise=0.02):
    """By the equation of motion of a pendulum, not by the simulation."""
    times, curve = np.arange(0.0, 3.0, 1 / 200), CubicSpline(FRAMES, CURVE)
    q, speed, faster = (curve(times, order) for order in range(3))
    effort = (MASS * LENGTH**2 + REAL.armature) * faster - MASS * G * LENGTH * np.cos(q) + REAL.viscous_friction * speed
    effort = effort + REAL.friction * np.tanh(speed / REAL.friction_speed)
    effort = effort + noise * np.random.default_rng(0).standard_normal(len(times))
    values = {EFFORT: effort, ANGLE: q}
    return SensorRecording("a.csv", "", tuple(Channel(kind, "/C/J0", times, values[kind][:, None]) for kind in kinds))


def test_efforts_tell_the_rotors_of_ideal_motors_without_a_simulation_for_each():
    settings = CalibrationSettings(("armature", "friction", "viscous_friction"), {"clock_offset": 0.01})
    found = calibrate_shot(shot(), [recording(EFFORT)], settings, RunSettings())
    for item, real in zip(found.estimates, (REAL.armature, REAL.friction, REAL.viscous_friction), strict=False):
        assert item.identifiable and item.value == pytest.approx(real, rel=0.05)
        assert abs(item.value - real) < 3.5 * item.standard_deviation
    (fit,) = found.channels
    assert fit.rms_before > 5.0 * fit.rms and fit.rms == pytest.approx(0.02, rel=0.1)
    assert found.simulations < 12 < found.iterations * len(settings.parameters)


def test_a_motion_tells_nothing_of_the_rotors_of_ideal_motors():
    kinds = ("armature", "encoder_offset")
    names = [p.kind for p in robot_parameters(shot(), kinds)]
    assert names == ["encoder_offset"]
    assert [p.kind for p in robot_parameters(shot(), kinds, efforts=["/C/J0"])] == ["armature", "encoder_offset"]
    found = calibrate_shot(shot(), [recording(ANGLE)], CalibrationSettings(kinds), RunSettings())
    assert [item.kind for item in found.estimates if item.of_robot] == ["encoder_offset"]
