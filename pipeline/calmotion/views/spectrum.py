"""Amplitude spectrum of the error of a target."""

import numpy as np

from calmotion.arrays import Array
from calmotion.model.result import Motion
from calmotion.views.playback import sample_motion

NEGLIGIBLE = 3e-4  # of the largest amplitude


def error_spectrum(motion: Motion, reference: Motion, target: int) -> tuple[Array, Array]:
    """Amplitude of the position error of a target by frequency, from the first frame of the shot on.

    A Hann window is applied to the components of the error. The spectrum is scaled so that a sine in any direction has
    its own amplitude at its frequency. The constant part of the error is removed.

    Args:
        motion: A simulated motion of equal steps.
        target: Index of the target.

    Returns:
        Frequencies [Hz] and amplitudes [m], shape [f] each.

    Source: Harris, On the use of windows for harmonic analysis with the discrete Fourier transform (1978).
    """
    rows = motion.judged
    times = motion.times[rows]
    if len(times) < 4:
        return np.zeros(0), np.zeros(0)
    error = motion.target_positions[rows, target] - sample_motion(reference, times).target_positions[:, target]
    window = np.hanning(len(times))
    # the windowed mean: a constant error does not leak into the lowest frequencies
    error = error - np.average(error, axis=0, weights=window)
    amplitudes = np.abs(np.fft.rfft(error * window[:, None], axis=0)) * (2.0 / window.sum())
    step = (times[-1] - times[0]) / (len(times) - 1)
    return np.fft.rfftfreq(len(times), step), np.sqrt(np.sum(amplitudes**2, axis=1))


def highest_frequency(frequencies: Array, amplitudes: Array) -> float:
    """The frequency above which all amplitudes are negligible [Hz]; 0 where all are zero."""
    significant = np.flatnonzero(amplitudes > NEGLIGIBLE * amplitudes.max(initial=0.0))
    return float(frequencies[significant[-1]]) if len(significant) else 0.0
