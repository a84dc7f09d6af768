"""The noise of sensors."""

import numpy as np
import pytest
from calmotion_plugins.calibration.identification.recordings.noise import (
    correlation_time,
    least_sigma,
    noise_of,
    spread_of,
)

T = np.linspace(0.0, 2.0, 2000)
RNG = np.random.default_rng(3)
WHITE = RNG.standard_normal((2000, 3))


def test_noise_is_told_from_a_smooth_signal_with_gaps_and_outliers():
    signal = np.stack([np.sin(20.0 * T), T**2, np.cos(5.0 * T)], axis=1) + 0.01 * WHITE
    signal[::50] = np.nan
    signal[7::190] += 3.0
    assert noise_of(signal) == pytest.approx(0.01, rel=0.1)
    assert spread_of(0.01 * WHITE) == pytest.approx(0.01, rel=0.05)


def test_a_rounded_signal_has_the_noise_of_its_rounding():
    rounded = np.round(np.sin(T), 2)[:, None]
    assert noise_of(rounded) >= 0.01 / np.sqrt(12.0) * 0.99
    assert least_sigma(np.sin(T)[:, None]) < 1e-5
    assert least_sigma(np.full((5, 1), np.nan)) == 1.0


def test_samples_that_are_correlated_count_as_fewer():
    assert correlation_time(WHITE) == pytest.approx(1.0, abs=0.1)
    moving = np.stack([np.convolve(WHITE[:, 0], np.ones(10), "valid")], axis=1)
    assert correlation_time(moving) == pytest.approx(10.0, rel=0.3)
    assert correlation_time(np.full((100, 1), np.nan)) == 1.0
