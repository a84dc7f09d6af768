"""Spectra: a sine has its amplitude at its frequency, whatever its direction, and constants have none."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import Motion
from calmotion.views.spectrum import error_spectrum, highest_frequency


def motion_of(times, errors):
    count = len(times)
    none = np.zeros((count, 0))
    return Motion(
        times=times,
        positions=np.zeros((count, 0, 3)),
        rotations=np.zeros((count, 0, 4)),
        elastic=(),
        motor_values=none,
        motor_efforts=none,
        target_positions=errors[:, None, :],
        target_rotations=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1, 1)),
    )


TIMES = np.arange(-200, 2001) / 500.0  # a pre-roll of 0.4 s, then 4 s
RUN_UP = np.where(TIMES < 0.0, 5.0, 0.0)


@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.36, 0.48, 0.8)])
def test_a_sine_has_its_amplitude_at_its_frequency(direction):
    shake = 0.02 * np.sin(2.0 * np.pi * 7.5 * TIMES) + 0.3 + RUN_UP
    meant = motion_of(TIMES, np.cumsum(np.ones((len(TIMES), 3)), axis=0))
    moved = dataclasses.replace(
        meant, target_positions=meant.target_positions + (shake[:, None] * np.array(direction))[:, None]
    )
    frequencies, amplitudes = error_spectrum(moved, meant, 0)
    peak = int(np.argmax(amplitudes))
    assert frequencies[peak] == pytest.approx(7.5, abs=0.5 / 4.0)
    assert amplitudes[peak] == pytest.approx(0.02, rel=1e-2)
    assert amplitudes[0] < 1e-12, "what is constant is no shake"
    assert 7.5 <= highest_frequency(frequencies, amplitudes) < 15.0


def test_the_reference_may_have_other_steps():
    coarse = np.linspace(-0.4, 4.0, 45)
    meant = motion_of(coarse, np.stack([coarse, 2.0 * coarse, 0.0 * coarse], axis=1))
    moved = motion_of(TIMES, np.stack([TIMES, 2.0 * TIMES, 0.01 * np.cos(2.0 * np.pi * 3.0 * TIMES)], axis=1))
    frequencies, amplitudes = error_spectrum(moved, meant, 0)
    assert amplitudes.max() == pytest.approx(0.01, rel=1e-2)
    assert frequencies[np.argmax(amplitudes)] == pytest.approx(3.0, abs=0.2)


def test_zero_errors_have_a_zero_spectrum_and_too_few_steps_have_none():
    still = motion_of(TIMES, np.zeros((len(TIMES), 3)))
    frequencies, amplitudes = error_spectrum(still, still, 0)
    assert not amplitudes.any() and highest_frequency(frequencies, amplitudes) == 0.0
    short = motion_of(TIMES[:202], np.zeros((202, 3)))
    assert error_spectrum(short, short, 0)[0].size == 0
