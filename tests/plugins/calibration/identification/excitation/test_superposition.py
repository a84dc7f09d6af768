"""Sums of responses to pulses, against simulations of whole motions."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import Animation, Track
from calmotion.model.run import RunSettings
from calmotion.recordings import ACCELEROMETER, ANGLE, MARKER, Channel, SensorRecording
from calmotion_plugins.calibration.identification.excitation.superposition import Superposition
from calmotion_plugins.calibration.identification.excitation.waveforms import bounds_of, family_of
from calmotion_plugins.calibration.identification.measurement import Measurement
from calmotion_plugins.calibration.identification.parameters import robot_parameters
from calmotion_plugins.calibration.identification.problem import Calibrated
from calmotion_plugins.calibration.identification.recordings.sensors import measurement_parameters, sensors_of
from calmotion_plugins.calibration.identification.robots import robot_with
from calmotion_plugins.calibration.identification.takes import Take
from recorded import LOAD, MOTOR, PLASTIC

AFTER, OPTIONS = 0.5, RunSettings(step=1 / 240, pre_roll=0.0, integrator="generalized-alpha")
NOISE = {MARKER: 3e-4, ACCELEROMETER: 0.1, ANGLE: 3e-4}


@pytest.fixture(scope="module")
def soft(recorded_shot):
    """An arm whose first mode, near 4 Hz, is among the tones."""
    return robot_with(recorded_shot, {("modulus", PLASTIC, -1): 2.4e8}).shot


@pytest.fixture(scope="module")
def family(soft):
    character, animation = soft.character, soft.animation
    bounds = bounds_of(character, animation, 0.1, 0.05)
    return family_of(character, animation, np.array([2.0, 3.0]), bounds, 3.0)


@pytest.fixture(scope="module")
def problem(soft, family):
    end = float(family.times[-1]) + AFTER
    # a sample in each frame, so that both have the same rows
    times = family.times[1] * np.arange(round(end / family.times[1]))
    recordings = [
        SensorRecording(kind, "", (Channel(kind, path, times, np.zeros((len(times), size)), NOISE[kind]),))
        for kind, path, size in ((MARKER, LOAD, 3), (ACCELEROMETER, LOAD, 3), (ANGLE, MOTOR, 1))
    ]
    clocks = [0.0] * len(recordings)
    measurement = Measurement(
        tuple(own.file for own in recordings),
        sensors_of(soft.character, recordings, clocks, -1.0, end, False),
        measurement_parameters(recordings, clocks),
    )
    parameters = robot_parameters(soft)

    def of(values):
        tracks = tuple(Track(family.times, column) for column in values.T)
        shot = dataclasses.replace(soft, animation=Animation(family.times, tracks, tracks))
        return Calibrated([Take(shot, parameters, AFTER)], measurement, OPTIONS)

    return of


def test_derivatives_are_those_of_a_simulation_of_the_motion(family, problem):
    responses, random = Superposition(family, problem), np.random.default_rng(1)
    for _ in range(2):
        values = family.tones_of(random.uniform(-1.0, 1.0, family.size))
        own = problem(values)
        exact = -own.linearized(np.zeros(len(own.lower)))[1]
        sensors = own.measurement.sensors
        counts = [own.channel.values.shape for own in sensors]
        total = counts[0][0]
        found = responses.jacobian(values).reshape(-1, sum(c for _, c in counts), exact.shape[1])[:total]
        # of all sensors at an instant, instead of one sensor after the other
        rows = np.split(exact, np.cumsum([n * c for n, c in counts])[:-1])
        exact = np.concatenate([own.reshape(n, c, -1) for own, (n, c) in zip(rows, counts, strict=True)], axis=1)
        scale = np.linalg.norm(exact, axis=(0, 1))
        off = np.linalg.norm(found - exact, axis=(0, 1)) / scale
        assert np.all(off < 0.35)  # 0.24 at most, by turns of 0.1 rad


def test_a_motor_that_may_not_move_has_no_response(family, problem):
    bounds = dataclasses.replace(family.bounds, lower=0.0 * family.bounds.lower, upper=0.0 * family.bounds.upper)
    still = dataclasses.replace(family, bounds=bounds)
    found = Superposition(still, problem).jacobian(family.tones_of(np.zeros(family.size)))
    again = Superposition(still, problem).jacobian(np.tile(family.start, (len(family.times), 1)))
    assert np.all(np.isfinite(found)) and np.array_equal(found, again)
