"""Frequency and damping of the free decay after a motion, as first values of a search.

A decay is a sum of damped exponentials, x_n = sum a_k z_k^n. The shift of the leading singular vectors of its Hankel
matrix has the z_k as eigenvalues (ESPRIT; Roy and Kailath 1989). The same estimate is made of what was measured and of
what the simulated robot does, so that its error is much the same in both: only their ratio is used.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from calmotion.recordings import ACCELEROMETER, MARKER, STRAIN
from scipy.signal import decimate

from ..measurement import Measurement, Motions
from .sensors import Sensor

ORDER = 8  # exponentials: four modes, or fewer and noise
FASTEST, MOST, FEWEST = 400.0, 400, 40  # samples in a second, and most and fewest samples that are used
PERIODS = 2.0  # fewest of the lowest frequency that counts
DAMPED = 0.3  # largest damping ratio of a mode that is seen as one
SETTLED = 0.02  # after the end of the motion [s]: delays


@dataclass(frozen=True)
class Decay:
    """The strongest mode of a decay.

    Attributes:
        frequency: [Hz].
        damping: Ratio.
    """

    frequency: float
    damping: float


def strongest_mode(values: Array, rate: float) -> Decay | None:
    """The mode with the most energy in a decay; None where there is none that is clear.

    Args:
        values: At uniform times, shape [n, c].
        rate: Of the samples [Hz].
    """
    if len(values) < FEWEST or not np.all(np.isfinite(values)):
        return None
    factor = int(rate // FASTEST)
    if factor > 1:
        values, rate = decimate(values, factor, axis=0, zero_phase=True), rate / factor
    values = values[:MOST] - values[len(values) // 2 :].mean(axis=0)
    count, columns = len(values), len(values) // 2
    hankel = np.concatenate([np.lib.stride_tricks.sliding_window_view(part, columns) for part in values.T], axis=0)
    vectors = np.linalg.svd(hankel, full_matrices=False)[2][:ORDER].T
    poles = np.linalg.eigvals(np.linalg.lstsq(vectors[:-1], vectors[1:], rcond=None)[0])
    poles = poles[np.abs(poles) > 1e-6]
    waves = poles[None, :] ** np.arange(count)[:, None]
    if not np.all(np.isfinite(waves)):
        return None
    amplitudes = np.linalg.lstsq(waves, values.astype(complex), rcond=None)[0]
    energies = np.sum(np.abs(waves) ** 2, axis=0) * np.sum(np.abs(amplitudes) ** 2, axis=1)
    exponents = np.log(poles) * rate
    frequencies, damping = np.abs(exponents) / (2.0 * np.pi), -exponents.real / np.abs(exponents)
    good = (exponents.imag > 0.0) & (damping > 0.0) & (damping < DAMPED)
    good &= (frequencies > PERIODS * rate / count) & (frequencies < 0.4 * rate)
    if not np.any(good):
        return None
    best = int(np.argmax(np.where(good, energies, -1.0)))
    return Decay(float(frequencies[best]), float(damping[best]))


def decay_factors(measurement: Measurement, motions: Motions, ends: Sequence[float]) -> tuple[float, float] | None:
    """By what frequency and damping of the recordings' decays differ from a simulated robot's; None where they tell
    neither.

    Args:
        measurement: With the recordings.
        motions: Of the robot.
        ends: Of the motions, on the robot's clock [s].
    """
    found = []
    zero = np.zeros(len(measurement.parameters))
    for sensor in measurement.sensors:
        if sensor.channel.kind not in (MARKER, ACCELEROMETER, STRAIN):
            continue
        times, end = measurement.robot_times(sensor, zero), ends[sensor.take]
        measured = _decay(sensor, times, sensor.channel.values, end)
        simulated = _decay(sensor, times, measurement.predicted(motions, sensor, zero), end)
        if measured is not None and simulated is not None:
            found.append((measured.frequency / simulated.frequency, measured.damping / simulated.damping))
    if not found:
        return None
    frequency, damping = np.median(np.array(found), axis=0)
    return float(frequency), float(damping)


def _decay(sensor: Sensor, times: Array, values: Array, end: float) -> Decay | None:
    """The decay in what one sensor measured, resampled where samples are missing."""
    rows = sensor.used & (times > end + SETTLED)
    complete = rows & np.all(np.isfinite(sensor.channel.values), axis=1)
    if complete.sum() < FEWEST:
        return None
    own = times[complete]
    step = float(np.median(np.diff(own)))
    even = np.arange(own[0], own[-1], step)
    resampled = np.stack([np.interp(even, own, column) for column in values[complete].T], axis=1)
    return strongest_mode(resampled, 1.0 / step)
