"""Frequency and damping of decays: of known signals, and of a robot against its recordings."""

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.recordings import ACCELEROMETER, ANGLE
from calmotion_plugins.calibration.identification.calibrate import CalibrationSettings, calibrate_shot
from calmotion_plugins.calibration.identification.recordings.free_decay import decay_factors, strongest_mode
from recorded import LOAD, PLASTIC, only, problem_of, recordings_of

TIMES = np.arange(0.0, 1.0, 1.0 / 400.0)


def mode(frequency, ratio, amplitude=1.0, phase=0.3):
    s = 2.0 * np.pi * frequency
    return amplitude * np.exp(-ratio * s * TIMES) * np.cos(s * np.sqrt(1.0 - ratio**2) * TIMES + phase)


def test_the_strongest_of_two_modes_is_found_in_noise():
    random = np.random.default_rng(1)
    values = np.stack([mode(7.3, 0.02) + mode(31.0, 0.01, 0.2), 0.3 * mode(7.3, 0.02, 1.0, 1.9) + 2.0], axis=1)
    exact = strongest_mode(values, 400.0)
    assert exact.frequency == pytest.approx(7.3, rel=1e-3) and exact.damping == pytest.approx(0.02, rel=0.02)
    noisy = strongest_mode(values + 0.02 * random.standard_normal(values.shape), 400.0)
    assert noisy.frequency == pytest.approx(7.3, rel=0.005) and noisy.damping == pytest.approx(0.02, rel=0.2)


def test_rest_and_what_is_too_short_tell_nothing():
    assert strongest_mode(np.zeros((30, 1)), 400.0) is None
    assert strongest_mode(np.zeros((200, 1)), 400.0) is None
    assert strongest_mode(np.linspace(0.0, 1.0, 200)[:, None], 400.0) is None


def test_a_stiffer_robot_with_more_damping_is_told_by_its_decay(recorded_shot):
    truth = {("modulus", PLASTIC, -1): 1.8e9 * 1.5, ("damping", PLASTIC, -1): 0.03}
    problem = problem_of(recorded_shot, only(recordings_of(recorded_shot, truth), ACCELEROMETER))
    end = float(recorded_shot.animation.frame_times[-1])
    factors = decay_factors(problem.measurement, problem.signals(np.zeros(len(problem.lower))), [end])
    assert factors[0] ** 2 == pytest.approx(1.5, rel=0.05) and factors[1] == pytest.approx(3.0, rel=0.15)


@pytest.mark.long
def test_a_modulus_far_beyond_its_prior_is_found(recorded_shot):
    truth = {("modulus", PLASTIC, -1): 0.35 * 1.8e9, ("damping", PLASTIC, -1): 0.03, ("mass", LOAD, -1): 0.2}
    recordings = only(recordings_of(recorded_shot, truth), ACCELEROMETER, ANGLE)
    settings = CalibrationSettings(halvings=0, priors={"mass": 0.01})
    found = calibrate_shot(recorded_shot, recordings, settings, RunSettings(step=1 / 480))
    assert found.estimate(f"modulus {PLASTIC}").value == pytest.approx(0.63e9, rel=0.02)
    assert found.estimate(f"damping {PLASTIC}").value == pytest.approx(0.03, rel=0.02)
