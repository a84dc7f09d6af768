"""Motors of one type share their parameters, and a calibration gives each of them its value."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.motor import DRIVE
from calmotion.model.run import RunSettings
from calmotion.recordings import ANGLE, Channel, SensorRecording
from calmotion.simulation.compiled_shot import compile_shot
from calmotion_plugins.calibration.identification.calibrate import CalibrationSettings, calibrate_shot
from calmotion_plugins.calibration.identification.motor_groups import grouped
from calmotion_plugins.calibration.identification.parameters import robot_parameters
from calmotion_plugins.calibration.identification.robots import robot_at, robot_with
from calmotion_plugins.calibration.identification.signals import signals_of

KINDS = ("position_gain", "velocity_gain", "encoder_offset")
PATHS = ("/Arm/Shoulder", "/Arm/Elbow")


@pytest.fixture(scope="module")
def shot(arm, animation, bodies):
    motors = tuple(
        dataclasses.replace(motor, kind="x", model=DRIVE, position_gain=gain, velocity_gain=2.0)
        for motor, gain in zip(arm.motors, (80.0, 120.0), strict=True)
    )
    return compile_shot(dataclasses.replace(arm, motors=motors), animation, bodies)


def test_one_parameter_stands_for_all_motors_of_its_type(shot):
    alone = robot_parameters(shot, KINDS)
    together = grouped(alone, shot.character)
    assert [p.name for p in together] == [
        "position_gain /Arm/Shoulder", "velocity_gain /Arm/Shoulder", "encoder_offset /Arm/Shoulder",
        "encoder_offset /Arm/Elbow",
    ]  # fmt: skip
    gains = [m.position_gain for m in robot_at(shot, together, np.array([1.0, 0.0, 0.0, 0.0])).shot.character.motors]
    assert gains == pytest.approx([80.0 * 1.3, 120.0 * 1.3])
    other = dataclasses.replace(shot.character.motors[1], kind="y")
    character = dataclasses.replace(shot.character, motors=(shot.character.motors[0], other))
    assert grouped(alone, character) == alone


def test_a_calibration_finds_the_shared_gain(shot):
    truth = {("position_gain", path, -1): gain for path, gain in zip(PATHS, (100.0, 150.0), strict=True)}
    signals = signals_of(robot_with(shot, truth), RunSettings(step=1 / 480), 0.5)
    times, random = np.arange(0.0, 2.0, 1 / 100), np.random.default_rng(2)
    channels = tuple(
        Channel(ANGLE, path, times, signals.at(ANGLE, k, times) + 3e-4 * random.standard_normal((len(times), 1)))
        for k, path in enumerate(PATHS)
    )
    settings = CalibrationSettings(("position_gain",), halvings=0, by_motor_type=True, after=0.5)
    found = calibrate_shot(shot, [SensorRecording("a", "", channels)], settings, RunSettings(step=1 / 120))
    estimates = [found.estimate(f"position_gain {path}") for path in PATHS]
    assert [e.value for e in estimates] == pytest.approx([100.0, 150.0], rel=0.01)
    assert estimates[1].value / estimates[0].value == pytest.approx(1.5, rel=1e-12)
    assert found.covariance.shape == (len(found.estimates),) * 2 and np.linalg.eigvalsh(found.covariance).min() > 0.0
