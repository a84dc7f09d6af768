"""The noise of a sensor: from its samples alone, and from the residuals of a fit."""

from math import comb

import numpy as np
from calmotion.arrays import Array

ORDER = 5  # of the differences, which a smooth signal has little of
TO_SIGMA = 1.4826  # median of absolute values to the standard deviation, for a normal distribution
FLOOR = 1e-6  # of the range of a signal: no sensor is better
LAGS = 400  # up to which residuals are correlated in time, at most


def noise_of(values: Array) -> float:
    """Standard deviation of the white noise of a sampled signal, from differences of fifth order.

    The median ignores outliers and the few samples at which the signal itself is not smooth. What a signal has
    close to half the sampling rate counts as noise.

    Args:
        values: Shape [n, c]; NaN where a sample is missing.
    """
    scale = np.sqrt(comb(2 * ORDER, ORDER))
    found = []
    for column in values.T:
        steps = np.diff(column, ORDER)
        steps = steps[np.isfinite(steps)]
        if len(steps):
            found.append(TO_SIGMA * float(np.median(np.abs(steps))) / scale)
    return max(float(np.sqrt(np.mean(np.square(found)))) if found else 0.0, least_sigma(values))


def least_sigma(values: Array) -> float:
    """A lower bound of the noise: that of rounding to the smallest step between samples, or a share of the range."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 1.0
    steps = np.diff(np.unique(known))
    finest = float(steps.min()) if len(steps) else 0.0
    # steps of a number that is not rounded are far below its range over the number of samples
    rounded = finest if len(steps) and len(steps) < 0.2 * len(known) else 0.0
    return max(float(rounded / np.sqrt(12.0)), FLOOR * float(np.ptp(known)), 1e-12)


def spread_of(residuals: Array) -> float:
    """Standard deviation of residuals without their outliers."""
    known = residuals[np.isfinite(residuals)]
    return TO_SIGMA * float(np.median(np.abs(known))) if len(known) else 0.0


def correlation_time(residuals: Array) -> float:
    """How many successive samples count as one: 1 + 2 sum of the autocorrelations up to the first that is not
    significant, over the columns of residuals, shape [n, c], NaN where there is none; 1 for white noise.

    Source: Sokal, Monte Carlo methods in statistical mechanics, 1997, section 3.
    """
    times = []
    for column in residuals.T:
        known = np.isfinite(column)
        n = int(known.sum())
        if n < 20:
            continue
        centred = np.where(known, column - column[known].mean(), 0.0)
        power = float(centred @ centred)
        if power <= 0.0:
            continue
        total = 1.0
        for lag in range(1, min(LAGS, n // 4)):
            share = float(centred[lag:] @ centred[:-lag]) / power
            if share < 2.0 / np.sqrt(n):
                break
            total += 2.0 * share
        times.append(total)
    return float(np.mean(times)) if times else 1.0
