"""How far estimates move from piece to piece of the recordings, where the model misses something.

What a model misses is no noise: each recording then has parameters of its own that fit it best, and standard deviations
by noise are too small for what another recording would tell. Every shot is cut into pieces. With the residuals r_p of a
piece about the common estimate, their Jacobian J_p, Huber's weights W and the prior, the piece alone would tell

    d_p = -(J_p^T W J_p + E)^-1 J_p^T W r_p

away from it. White noise makes the variance s (1 - s) of an entry of d_p, where s is the share of the prior's variance
that the piece leaves; the rest is the variance from piece to piece, by the method of moments. It is added whole, not
over the number of pieces, and with the quantile of Student's distribution for so many of them, as for the prediction
of another study in a meta-analysis; the prior bounds the sum.

Source: Higgins, Thompson, Spiegelhalter, A re-evaluation of random-effects meta-analysis, 2009, section 3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from calmotion.arrays import Array
from scipy.stats import norm, t

from .least_squares import HUBER, Solution, weights_of
from .recordings.noise import noise_of

if TYPE_CHECKING:
    from .problem import Calibrated
    from .recordings.sensors import Sensor

PIECES = 4  # of each shot
MISSED, TOGETHER = 1.5, 3.0  # residuals over the noise, and samples that count as one: the model misses something


def misses(sensor: Sensor, rms: float) -> float:
    """What is left of a sensor's signal over its noise, where this is more than noise and not at random; else 0."""
    noise = sensor.channel.sigma if sensor.channel.sigma is not None else noise_of(sensor.channel.values[sensor.used])
    return rms / noise if rms > MISSED * noise and sensor.count > TOGETHER else 0.0


def widened(problem: Calibrated, solution: Solution, covariance: Array) -> Array:
    """By how much standard deviations are wider where pieces of the recordings are to be believed, shape [n].

    Args:
        problem: With the noise of the residuals, and the number of them that counts as one.
        solution: The common estimate.
        covariance: Of z, by noise.
    """
    deviations = np.sqrt(np.clip(np.diag(covariance), 1e-300, 1.0 - 1e-9))
    sensors = problem.measurement.sensors
    if not any(misses(sensor, sensor.sigma) for sensor in sensors):
        return np.ones_like(deviations)
    pieces = _pieces(problem, solution.z)
    size, weights = np.clip(solution.residuals, -HUBER, HUBER), weights_of(solution.residuals)
    unit, moved, left = np.eye(len(deviations)), [], []
    for piece in np.unique(pieces):
        own = pieces == piece
        J = solution.jacobian[own]
        inverse = np.linalg.inv(J.T @ (weights[own, None] * J) + unit)
        moved.append(-inverse @ (J.T @ size[own]))
        left.append(np.diag(inverse))
    share = np.clip(np.array(left), 0.0, 1.0 - 1e-9)
    told = np.maximum(((1.0 - share) ** 2).sum(axis=0), 1e-12)
    between = np.maximum((np.array(moved) ** 2 - share * (1.0 - share)).sum(axis=0) / told, 0.0)
    between *= (t.ppf(0.975, max(len(moved) - 2, 1)) / norm.ppf(0.975)) ** 2
    # what the recordings tell without the prior, then with it
    alone = 1.0 / (1.0 / deviations**2 - 1.0)
    return np.asarray(np.sqrt(1.0 / (1.0 + 1.0 / (alone + between))) / deviations)


def _pieces(problem: Calibrated, z: Array) -> Array:
    """The number of the piece of each residual, shape [N]."""
    measurement, y = problem.measurement, z[len(problem.parameters) :]
    found = []
    for sensor in measurement.sensors:
        times = measurement.robot_times(sensor, y)
        known = times[sensor.used]
        span = max(float(known[-1] - known[0]), 1e-9)
        own = np.clip(((times - known[0]) * PIECES / span).astype(int), 0, PIECES - 1) + PIECES * sensor.take
        found.append(np.broadcast_to(own[:, None], sensor.fitted.shape)[sensor.fitted])
    return np.concatenate(found)
