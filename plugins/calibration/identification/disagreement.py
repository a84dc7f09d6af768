"""How far parameters move from piece to piece of the recordings, where the model misses something.

What a model misses is no noise: each recording then has parameters of its own that fit it best. Standard deviations by
noise are too small for what another recording would tell, and the common estimate follows what the model lacks, far
from what was known of the robot. Every shot is cut into pieces, and the robot of a piece has parameters z + b, b of a
variance B of its own. With the residuals r_p of a piece, their Jacobian J_p, Huber's weights W and the prior, the piece
alone would tell

    d_p = -(J_p^T W J_p + E)^-1 J_p^T W r_p

away from the common estimate. White noise makes the variance s (1 - s) of an entry of d_p, where s is the share of the
prior's variance that the piece leaves; the rest is B, by the method of moments. The estimate is that of residuals whose
covariance is N + J_p B J_p^T in each piece, N that of their noise. For what another recording tells, B is added whole,
not over the number of pieces, and with the quantile of Student's distribution for so many of them, as for the
prediction of another study in a meta-analysis; the prior bounds the sum.

Source: Lindstrom, Bates, Nonlinear mixed effects models for repeated measures data, 1990; Higgins, Thompson,
Spiegelhalter, A re-evaluation of random-effects meta-analysis, 2009, section 3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array, BoolArray
from calmotion.model import RunSettings
from scipy.stats import norm, t

from .least_squares import HUBER, Solution, minimize, posterior, weights_of
from .problem import Calibrated
from .recordings.noise import noise_of
from .recordings.sensors import Sensor

PIECES = 4  # of each shot
MISSED, TOGETHER = 1.5, 3.0  # residuals over the noise, and samples that count as one: the model misses something
DISAGREES = 1.5  # times as wide as noise makes it: pieces of the recordings tell other values
TURNS, SETTLED = 8, 0.05  # of variances and estimates, and the change of these at which they end, in priors


def misses(sensor: Sensor, rms: float) -> float:
    """What is left of a sensor's signal over its noise, where this is more than noise and not at random; else 0."""
    noise = sensor.channel.sigma if sensor.channel.sigma is not None else noise_of(sensor.channel.values[sensor.used])
    return rms / noise if rms > MISSED * noise and sensor.count > TOGETHER else 0.0


@dataclass(frozen=True, eq=False)
class Scattered:
    """A robot whose parameters differ from piece to piece, as a `least_squares.Problem`.

    Attributes:
        plain: The robot and its recordings.
        between: Variance of each entry of z from piece to piece, with Student's quantile, shape [n].
        scatter: That of a piece, of the robot's parameters, shape [n].
        pieces: Which residuals are of each piece, an orthogonal basis of what its own parameters do to them over the
            roots of their counts, and by what share each direction is taken back; none where all pieces agree.
        disagrees: Whether the pieces tell other values by more than noise, shape [n]; None: they do not.
    """

    plain: Calibrated
    between: Array
    scatter: Array
    pieces: tuple[tuple[BoolArray, Array, Array], ...] = ()
    disagrees: BoolArray | None = None

    @property
    def counts(self) -> Array:
        """How many successive residuals count as one, shape [N]."""
        return self.plain.counts

    @property
    def lower(self) -> Array:
        """Least values of z."""
        return self.plain.lower

    def with_options(self, options: RunSettings) -> Scattered:
        """The same with another step."""
        return replace(self, plain=self.plain.with_options(options))

    def of(self, values: Array) -> Array:
        """Residuals, or their derivatives, of unit variance where pieces have parameters of their own."""
        found, root = values.copy(), np.sqrt(self.counts)
        for own, basis, share in self.pieces:
            along = basis.T @ (values[own].T / root[own]).T
            found[own] -= (root[own] * (basis @ (share * along.T).T).T).T
        return found

    def residuals(self, z: Array) -> Array | None:
        """At z; None where the robot cannot be simulated."""
        found = self.plain.residuals(z)
        return None if found is None else self.of(found)

    def linearized(self, z: Array) -> tuple[Array, Array]:
        """With their derivative."""
        residuals, jacobian = self.plain.linearized(z)
        return self.of(residuals), self.of(jacobian)

    def widened(self, covariance: Array) -> Array:
        """A covariance of z as what other recordings would tell has it, shape [n, n]."""
        deviations = np.sqrt(np.clip(np.diag(covariance), 1e-300, 1.0 - 1e-9))
        # what the recordings tell without the prior, then with it
        alone = 1.0 / (1.0 / deviations**2 - 1.0)
        wider = np.sqrt(1.0 / (1.0 + 1.0 / (alone + self.between))) / deviations
        wider = np.where(self.between > 0.0, wider, 1.0)
        return np.asarray(wider[:, None] * covariance * wider)


def together(problem: Calibrated) -> Scattered:
    """A robot that is the same in all pieces."""
    none = np.zeros(len(problem.lower))
    return Scattered(problem, none, none)


def settled(problem: Calibrated, solution: Solution) -> tuple[Scattered, Solution]:
    """The estimate for pieces that have parameters of their own; the given one where the model explains the recordings.

    Of a single shot the given one stays, with wider deviations: that parameters are not the same in another motion, no
    other motion tells.

    Args:
        problem: With the noise of the residuals, and the number of them that counts as one.
        solution: The common estimate.
    """
    apart = together(problem)
    if not any(misses(sensor, sensor.sigma) for sensor in problem.measurement.sensors):
        return apart, solution
    residuals, jacobian = solution.residuals, solution.jacobian
    if len(problem.takes) == 1:
        return replace(_scattered(apart, solution.z, residuals, jacobian), pieces=()), solution
    for _ in range(TURNS):
        # variances that an estimate has shown stay: else it returns to where pieces seem to agree
        apart = _scattered(apart, solution.z, residuals, jacobian)
        before, solution = solution.z, minimize(apart, solution.z, apart.lower)
        if np.abs(solution.z - before).max() < SETTLED or solution.interrupted:
            break
        residuals, jacobian = problem.linearized(solution.z)
    return apart, solution


def _scattered(earlier: Scattered, z: Array, residuals: Array, jacobian: Array) -> Scattered:
    """The problem with variances from piece to piece at least as large as before, and as the residuals about z tell."""
    problem = earlier.plain
    pieces = _pieces(problem, z)
    size, weights = np.clip(residuals, -HUBER, HUBER), weights_of(residuals)
    unit, moved, left = np.eye(len(z)), [], []
    each = [pieces == piece for piece in np.unique(pieces)]
    for own in each:
        J = jacobian[own]
        inverse = np.linalg.inv(J.T @ (weights[own, None] * J) + unit)
        moved.append(-inverse @ (J.T @ size[own]))
        left.append(np.diag(inverse))
    share = np.clip(np.array(left), 0.0, 1.0 - 1e-9)
    told = np.maximum(((1.0 - share) ** 2).sum(axis=0), 1e-12)
    between = np.maximum((np.array(moved) ** 2 - share * (1.0 - share)).sum(axis=0) / told, 0.0)
    # a robot differs from itself by no more than was known of it; clocks and sensors do not change
    of_robot = np.arange(len(z)) < len(problem.parameters)
    scatter = np.maximum(np.where(of_robot, np.minimum(between, 1.0), 0.0), earlier.scatter)
    root, directions = np.sqrt(problem.counts), []
    for own in each:
        basis, values, _ = np.linalg.svd(jacobian[own] / root[own, None] * np.sqrt(scatter), full_matrices=False)
        directions.append((own, basis, 1.0 - 1.0 / np.sqrt(1.0 + values**2)))
    between *= (t.ppf(0.975, max(len(moved) - 2, 1)) / norm.ppf(0.975)) ** 2
    found = Scattered(problem, between, scatter, tuple(directions))
    by_noise = posterior(jacobian, residuals, problem.counts)
    wider = np.sqrt(np.diag(found.widened(by_noise)) / np.diag(by_noise))
    return replace(found, disagrees=wider > DISAGREES)


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
