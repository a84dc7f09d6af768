"""Sensors, their clocks, and the derivatives of what they measure."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model.run import RunSettings
from calmotion_plugins.calibration.identification.measurement import Measurement
from calmotion_plugins.calibration.identification.recordings.clocks import clock_of
from calmotion_plugins.calibration.identification.recordings.sensors import measurement_parameters, sensors_of
from calmotion_plugins.calibration.identification.robots import robot_with
from calmotion_plugins.calibration.identification.signals import signals_of
from recorded import CLOCKS

OPTIONS = RunSettings(step=1 / 240, integrator="generalized-alpha")


@pytest.fixture(scope="module")
def shot(recorded_shot):
    return recorded_shot


@pytest.fixture(scope="module")
def signals(shot):
    return signals_of(robot_with(shot, {}), OPTIONS, 0.5)


@pytest.fixture(scope="module")
def measurement(shot, recordings):
    clocks = list(CLOCKS.values())
    return Measurement(
        tuple(r.file for r in recordings), sensors_of(shot.character, recordings, clocks, -0.5, 1.75),
        measurement_parameters(recordings, clocks),
    )  # fmt: skip


def test_clocks_are_found_with_the_parameters_of_the_shot(shot, recordings, signals):
    for recording in recordings:
        assert clock_of(recording, shot.character, [signals]) == pytest.approx(CLOCKS[recording.file], abs=0.012)


def test_the_clock_is_that_of_the_robot_which_is_most_like_the_recording(shot, recordings, signals):
    unlike = dataclasses.replace(
        signals, positions=signals.positions[::-1], angles=signals.angles[::-1], rotations=signals.rotations[::-1],
        _splines={},
    )  # fmt: skip
    for recording in recordings:
        right = pytest.approx(CLOCKS[recording.file], abs=0.012)
        assert clock_of(recording, shot.character, [unlike]) != right
        assert clock_of(recording, shot.character, [unlike, signals]) == right


def test_derivatives_are_those_of_what_is_predicted(measurement, signals):
    x = 0.1 * np.arange(1.0, len(measurement.parameters) + 1.0)
    for sensor in measurement.sensors:
        exact = measurement.derivatives([signals], sensor, x)
        scale = np.abs(exact).max(axis=(0, 1)) + 1e-12
        for k in range(len(x)):
            h = 1e-4 * np.eye(len(x))[k]
            up, down = (measurement.predicted([signals], sensor, x + s * h) for s in (1.0, -1.0))
            assert np.abs((up - down) / 2e-4 - exact[:, :, k]).max() < 2e-3 * scale[k]


def test_residuals_leave_out_gaps_and_what_is_held_out(measurement, signals):
    counts = [int(sensor.fitted.sum()) for sensor in measurement.sensors]
    assert len(measurement.residuals([signals], np.zeros(len(measurement.parameters)))) == sum(counts)
    for sensor, count in zip(measurement.sensors, counts, strict=True):
        held = int(sensor.validated.sum())
        assert 0.1 < held / (held + count) < 0.3
        missing = int(np.isnan(sensor.channel.values[sensor.used]).sum())
        assert held + count + missing == sensor.used.sum() * sensor.channel.values.shape[1]


def test_noise_is_estimated_where_it_is_not_given(measurement, shot, recordings):
    sigmas = [sensor.sigma for sensor in measurement.sensors]
    assert sigmas == pytest.approx([3e-4, 0.1, 3e-4, 0.02], rel=0.25)
    known = dataclasses.replace(recordings[0].channels[0], sigma=7e-4)
    other = dataclasses.replace(recordings[0], channels=(known,))
    assert sensors_of(shot.character, [other], [CLOCKS["camera.csv"]], -0.5, 1.75)[0].sigma == 7e-4


def test_a_channel_of_another_robot_or_another_time_is_refused(shot, recordings):
    camera = recordings[0]
    lost = dataclasses.replace(camera.channels[0], path="/Arm/Lode")
    with pytest.raises(ShotError, match="/Arm/Load"):
        sensors_of(shot.character, [dataclasses.replace(camera, channels=(lost,))], [0.0], -0.5, 1.75)
    with pytest.raises(ShotError, match="too few samples"):
        sensors_of(shot.character, [camera], [100.0], -0.5, 1.75)
