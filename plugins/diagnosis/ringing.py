"""Frequencies at which a signal rings, whatever the cause: of what is left, and of spectra that printers write."""

from typing import Any

import numpy as np
from calmotion.arrays import Array
from scipy.signal import find_peaks, peak_widths

from .situation import Situation

CLEAR = 6.0  # power of a peak, of the median over an octave about it
MOST = 2  # peaks of a signal
RANGE = (1.0, 150.0)  # [Hz]


def ringing(situation: Situation, left: Array) -> tuple[dict[str, Any], ...]:
    """Frequency and damping of the clearest peaks in what is not explained of each sensor, as rows of a report."""
    rows: list[dict[str, Any]] = []
    for sensor, own in zip(situation.sensors, situation.blocks_of, strict=True):
        signal = max((left[situation.blocks[b]] for b in own), key=lambda part: float(part @ part))
        period = float(np.median(np.diff(sensor.times)))
        length = min(len(signal), max(256, round(4.0 / period)))
        power = np.zeros(length // 2 + 1)
        for start in range(0, len(signal) - length + 1, max(length // 2, 1)):
            power += np.abs(np.fft.rfft(signal[start : start + length] * np.hanning(length))) ** 2
        rows += peaks(np.asarray(np.fft.rfftfreq(length, period), float), power, sensor.path)
    return tuple(rows)


def peaks(frequencies: Array, power: Array, path: str) -> list[dict[str, Any]]:
    """The clearest peaks of a power spectrum at even frequencies [Hz]: frequency, and damping by the width at half of
    their power."""
    step = float(frequencies[1] - frequencies[0])
    found, _ = find_peaks(power)
    clear = []
    for k in found:
        f = frequencies[k]
        near = (frequencies > f / 1.41) & (frequencies < 1.41 * f)
        if RANGE[0] < f < RANGE[1] and power[k] > CLEAR * np.median(power[near]):
            clear.append(int(k))
    clear = sorted(clear, key=lambda k: -power[k])[:MOST]
    widths = peak_widths(power, clear, rel_height=0.5)[0] if clear else []
    rows: list[dict[str, Any]] = []
    for k, width in zip(clear, widths, strict=True):
        f = float(frequencies[k])
        rows.append({"name": "frequency", "path": path, "value": f, "unit": "Hz"})
        rows.append({"name": "damping", "path": path, "value": 0.5 * float(width) * step / f, "unit": "of critical"})
    return rows
