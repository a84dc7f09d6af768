"""How much a target shakes at each frequency."""

from __future__ import annotations

import numpy as np

from calmotion.shot.character import Array
from calmotion.shot.result import Motion
from calmotion.views.playback import sample_motion

LEFT = 3e-4  # of the largest amplitude: frequencies beyond the last one above this are of no interest


def error_spectrum(motion: Motion, reference: Motion, target: int) -> tuple[Array, Array]:
    """Amplitude of the position error of a target by frequency, from the first frame of the shot on.

    The error's components are taken through Hann's window, scaled so that a sine of one amplitude, however directed,
    has that amplitude at its frequency; what is constant is not part of it.

    Args:
        motion: A simulated motion of equal steps.
        reference: What was meant.
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
    # the mean as the window sees it, so that nothing of a constant error leaks into the lowest frequencies
    error = error - np.average(error, axis=0, weights=window)
    amplitudes = np.abs(np.fft.rfft(error * window[:, None], axis=0)) * (2.0 / window.sum())
    step = (times[-1] - times[0]) / (len(times) - 1)
    return np.fft.rfftfreq(len(times), step), np.sqrt(np.sum(amplitudes**2, axis=1))


def highest_frequency(frequencies: Array, amplitudes: Array) -> float:
    """The frequency above which nothing of interest happens [Hz]; 0 where nothing happens at all."""
    worth = np.flatnonzero(amplitudes > LEFT * amplitudes.max(initial=0.0))
    return float(frequencies[worth[-1]]) if len(worth) else 0.0
