"""Keyed curves as an animation package eases them: monotone between keys, flat at holds and extremes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Key = tuple[float, float]


def key_slopes(keys: Sequence[Key]) -> list[float]:
    """Slope at each key: the weighted harmonic mean of its neighbours' chords, zero where they change sign.

    Fritsch and Butland (1984): the interpolant never leaves the range of the two keys it lies between.
    """
    chords = [(v1 - v0) / (t1 - t0) for (t0, v0), (t1, v1) in zip(keys, keys[1:], strict=False)]
    slopes = [0.0]
    for i in range(1, len(keys) - 1):
        left, right = chords[i - 1], chords[i]
        if left * right <= 0.0:
            slopes.append(0.0)
            continue
        span_left, span_right = keys[i][0] - keys[i - 1][0], keys[i + 1][0] - keys[i][0]
        weight_left, weight_right = 2.0 * span_right + span_left, span_right + 2.0 * span_left
        slopes.append((weight_left + weight_right) / (weight_left / left + weight_right / right))
    return [*slopes, 0.0]


def sample_keys(keys: Sequence[Key], frames: Sequence[int]) -> NDArray[np.float64]:
    """Values of the curve at the frames; before the first key and after the last it holds."""
    slopes = key_slopes(keys)
    times = [key[0] for key in keys]
    values = np.empty(len(frames))
    for n, frame in enumerate(frames):
        if frame <= times[0] or frame >= times[-1]:
            values[n] = keys[0][1] if frame <= times[0] else keys[-1][1]
            continue
        i = int(np.searchsorted(times, frame, side="right")) - 1
        (t0, v0), (t1, v1) = keys[i], keys[i + 1]
        span = t1 - t0
        s = (frame - t0) / span
        values[n] = (
            (2 * s**3 - 3 * s**2 + 1) * v0
            + (s**3 - 2 * s**2 + s) * span * slopes[i]
            + (3 * s**2 - 2 * s**3) * v1
            + (s**3 - s**2) * span * slopes[i + 1]
        )
    return values
