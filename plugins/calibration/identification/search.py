"""The search for a robot's parameters: a start, the noise of the sensors, and a time step that does not matter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array, BoolArray
from calmotion.errors import ShotError
from calmotion.multibody import SimulationFailure, in_parallel
from calmotion.support import answer
from scipy.stats import norm
from scipy.stats.qmc import Sobol

from ..model import kinds
from .disagreement import Scattered, settled, together
from .least_squares import Solution, chord, loss_of, minimize, posterior, weights_of
from .measurement import Measurement
from .model_error import covariance_of_model
from .problem import Calibrated, Measured, correlated, renoised
from .recordings.free_decay import decay_factors
from .recordings.sensors import Sensor
from .takes import STIFF

TRIED = np.linspace(-2.4, 2.4, 17)  # of all of them at once, in standard deviations of their priors
FARTHEST = 5.0  # that the free decay may be away from the shot, in standard deviations
DRAWN, FEW = 16, 24  # robots by their priors that are tried as well, and most parameters that these can tell apart
BEST = 3  # of these, from which searches begin until one explains the recordings
FIRST_ITERATIONS, EXPLAINED = 6, 2.0  # of such a search, and its loss over that of noise alone
NEAR = 0.3  # change at which it ends, in standard deviations: another one follows
ROUNDS, STEADY = 5, 0.05  # of the noise, and its relative change at which they end
COARSE = 0.3  # error of a step, over the noise, with which no search begins but for a first guess
HALVINGS, SHIFT = 5, 0.2  # of the step, and the change of an estimate at which they end, over its standard deviation
ORDER = 2  # of the integrators


@dataclass(frozen=True, eq=False)
class Found:
    """Where a search ended.

    Attributes:
        z: Parameters of the robot and of the measurement, in standard deviations of their priors.
        problem: With the last step and the noise of the sensors.
        solution: The last minimum, before what is left of the error of the step is taken off.
        covariance: Of z.
        iterations: In all.
        shift: Largest change by the last halving of the step, over its standard deviation.
        disagrees: Entries of z that pieces of the recordings tell differently, by more than the rest of the covariance,
            shape [n].
        interrupted: Whether the step was not halved as far as it should.
    """

    z: Array
    problem: Calibrated
    solution: Solution
    covariance: Array
    iterations: int
    shift: float
    disagrees: BoolArray
    interrupted: bool = False


def search(problem: Calibrated, tell: Callable[[float, str], None], halvings: int = HALVINGS) -> Found:
    """The parameters at which the robot moves as recorded.

    Raises:
        ShotError: No robot near the shot can be simulated.
    """
    starts = _starts(problem, tell)
    tell(0.3, "fitting the parameters")
    best, z, iterations, interrupted = _roughly(problem, starts)
    apart, solution = together(best), None
    try:  # what was found is not thrown away
        if not interrupted:
            best, halvings = _resolved(best, z, halvings)
        for _ in range(0 if interrupted else ROUNDS):
            solution = minimize(best, z, best.lower)
            z, iterations = solution.z, iterations + solution.iterations
            used = np.array([s.sigma for s in best.measurement.sensors])
            best = best.with_measurement(renoised(best, z))
            best = best.with_measurement(correlated(best, z))
            off = np.abs(np.array([s.sigma for s in best.measurement.sensors]) / used - 1.0)
            if np.all(off < STEADY) or solution.interrupted:
                break
        apart = together(best)
        if solution is not None and not solution.interrupted:
            tell(0.7, "comparing pieces of the recordings")
            apart, solution = settled(best, solution)
            tell(0.8, "halving the time step")
    except KeyboardInterrupt:
        answer()
        apart, interrupted = together(best), True
    if solution is None:
        apart, solution = _noted(best, z)
    interrupted = interrupted or solution.interrupted
    return _converged(apart, solution, iterations, 0 if interrupted else halvings, interrupted)


def _roughly(problem: Calibrated, starts: Sequence[Array]) -> tuple[Calibrated, Array, int, bool]:
    """The best of short searches from some starts, until one explains the recordings; and whether it was interrupted.

    Raises:
        KeyboardInterrupt: Before there is any.
    """
    rough: list[_Rough] = []
    count = sum(int(sensor.fitted.sum()) for sensor in problem.measurement.sensors)
    interrupted = False
    try:
        for start in starts:
            rough.append(_from(problem, start, FIRST_ITERATIONS))
            interrupted = rough[-1].interrupted
            if interrupted or rough[-1].cost < EXPLAINED * 0.5 * count:
                break
    except KeyboardInterrupt:
        if not rough:
            raise
        answer()
        interrupted = True
    best = min(rough, key=lambda item: item.cost)
    return best.problem, best.z, best.iterations, interrupted


def _noted(problem: Calibrated, z: Array) -> tuple[Scattered, Solution]:
    """Where a search was interrupted, with the noise of the residuals there."""
    problem = problem.with_measurement(renoised(problem, z))
    problem = problem.with_measurement(correlated(problem, z))
    residuals, jacobian = problem.linearized(z)
    cost = loss_of(residuals, problem.counts) + 0.5 * float(z @ z)
    return together(problem), Solution(z, residuals, jacobian, cost, 0, False, True)


def _resolved(problem: Calibrated, z: Array, halvings: int) -> tuple[Calibrated, int]:
    """The problem with a step whose error is small beside what is left at z, and how many halvings are left: a search
    with a coarse step goes astray where combinations of parameters are hardly known, as modulus and mass together."""
    left = problem.residuals(z)
    while halvings and left is not None:
        finer = problem.with_options(replace(problem.options, step=0.5 * step_of(problem)))
        then = finer.residuals(z)
        if then is None or float(np.sqrt(np.mean((then - left) ** 2))) < COARSE:
            break
        problem, left, halvings = finer, then, halvings - 1
    return problem, halvings


def _converged(
    problem: Scattered, solution: Solution, iterations: int, halvings: int, interrupted: bool = False
) -> Found:
    """The minimum for ever smaller steps, extrapolated to a step of zero.

    Derivatives are those of the first step where they serve: a minimum with another step is near, and its residuals
    alone decide where.
    """
    deviations, of_model = _deviations(problem, solution)
    limit, shift, extrapolated = solution.z, 0.0, False
    for _ in range(halvings):
        options = replace(problem.plain.options, step=0.5 * step_of(problem.plain))
        finer = problem.with_options(options)
        try:
            if finer.residuals(solution.z) is None:  # it cannot be simulated with this step
                break
            other = chord(finer, solution)
            if other is None:  # derivatives there are others
                other = minimize(finer, solution.z, finer.lower, FIRST_ITERATIONS)
                if other.interrupted:
                    interrupted = True
                    break
                iterations += other.iterations - 1
                deviations, of_model = _deviations(finer, other)
        except KeyboardInterrupt:  # what converged is not thrown away
            answer()
            interrupted = True
            break
        except (ShotError, SimulationFailure):  # nor can a robot near it
            break
        change = other.z - solution.z
        problem, solution, iterations = finer, other, iterations + 1
        then = np.maximum(solution.z + change / (2**ORDER - 1), problem.lower)
        # the first extrapolation is compared with what it extrapolates, the next ones with the one before
        off = then - limit if extrapolated else change / (2**ORDER - 1)
        shift = float(np.max(np.abs(off) / deviations, initial=0.0))
        limit, extrapolated = then, True
        if shift <= SHIFT:
            break
    plain = problem.plain.with_measurement(correlated(problem.plain, solution.z))
    covariance = problem.widened(posterior(solution.jacobian, solution.residuals, plain.counts) + of_model)
    disagrees = np.zeros(len(limit), bool) if problem.disagrees is None else problem.disagrees
    return Found(limit, plain, solution, covariance, iterations, shift, disagrees, interrupted)


def step_of(problem: Calibrated) -> float:
    """The step of its simulations [s]."""
    assert problem.options.step is not None
    return problem.options.step


def _deviations(problem: Scattered, solution: Solution) -> tuple[Array, Array]:
    """Standard deviations of z about a solution, and the covariance by what the model has wrong.

    Residuals that are correlated in time count as fewer.
    """
    counts = correlated(problem.plain, solution.z).counts
    weights = weights_of(solution.residuals) / counts
    of_model = covariance_of_model(problem.plain, solution.z, solution.jacobian, weights, problem.of)
    covariance = posterior(solution.jacobian, solution.residuals, counts) + of_model
    return np.sqrt(np.diag(covariance)), of_model


def profiled(problem: Calibrated, z: Array) -> tuple[Array, float]:
    """z with the best parameters of the measurement for its robot, and the loss with the prior."""
    n = len(problem.parameters)
    solution = minimize(Measured(problem.measurement, problem.signals(z)), z[n:], problem.lower[n:])
    if solution.interrupted:
        raise KeyboardInterrupt
    return np.concatenate([z[:n], solution.z]), solution.cost + 0.5 * float(z[:n] @ z[:n])


@dataclass(frozen=True, eq=False)
class _Rough:
    """Where a short search ended: its loss with the noise that sensors have, and what was found."""

    cost: float
    problem: Calibrated
    z: Array
    iterations: int
    interrupted: bool


def _from(problem: Calibrated, start: Array, most: int) -> _Rough:
    """A search from a start, with noise as large as what the start leaves: far residuals then keep their weight."""
    free, z, iterations, interrupted = _without_given_noise(problem), start, 0, False
    for _ in range(2):
        wide = free.with_measurement(renoised(free, z))
        try:
            found = minimize(wide, z, wide.lower, most, NEAR)
        except KeyboardInterrupt:
            if not iterations:
                raise
            answer()
            interrupted = True
            break
        free, z, iterations = wide, found.z, iterations + found.iterations
        if found.interrupted:
            interrupted = True
            break
    # compared with the noise that the sensors have
    free = free.with_measurement(renoised(free, z))
    r = problem.with_measurement(problem.measurement).residuals(z)
    sensors = [
        replace(own, sigma=own.sigma if own.channel.sigma is not None else sensor.sigma)
        for own, sensor in zip(problem.measurement.sensors, free.measurement.sensors, strict=True)
    ]
    cost = np.inf if r is None else loss_of(r)
    known = free.with_measurement(free.measurement.with_sensors(sensors))
    return _Rough(cost, known, z, iterations, interrupted)


def _without_given_noise(problem: Calibrated) -> Calibrated:
    """The problem with sensors whose noise is not known."""
    sensors = [replace(s, channel=replace(s.channel, sigma=None)) for s in problem.measurement.sensors]
    return problem.with_measurement(problem.measurement.with_sensors(sensors))


def _starts(problem: Calibrated, tell: Callable[[float, str], None]) -> list[Array]:
    """The best of robots that are stiffer and softer than the shot's: a search finds only frequencies that it can tell
    apart from their neighbours by less than half an oscillation over the recording."""
    m = len(problem.measurement.parameters)
    stiff = np.array([p.kind in STIFF for p in problem.parameters], float)
    tell(0.1, "looking for the stiffness")
    points = [np.concatenate([v * stiff, np.zeros(m)]) for v in (TRIED if stiff.any() else (0.0,))]
    points += _of_decay(problem) + _drawn(problem)

    def tried(z: Array) -> tuple[float, Array, Calibrated] | None:
        own = problem.with_measurement(problem.measurement)
        try:
            own.signals(z)
        except (ShotError, SimulationFailure):
            return None
        own = own.with_measurement(_common_noise(own))
        z, cost = profiled(own, z)
        return cost, z, own

    found = [item for item in in_parallel(tried, points) if item is not None]
    problem.simulations += len(points)
    if not found:
        raise ShotError(
            "neither the robot nor a stiffer or softer one can be simulated",
            path=problem.shot.character.path,
            remedy="Run `calmotion simulate` on the shot, which says why",
        )
    found.sort(key=lambda item: item[0])
    return [z for _, z, _ in found[:BEST]]


def _drawn(problem: Calibrated) -> list[Array]:
    """Robots all over the priors, where a motor's friction or largest torque is estimated: these decide how a robot
    moves only beyond some torque, so that a search that begins on the other side does not find them."""
    n, m = len(problem.parameters), len(problem.measurement.parameters)
    own = np.array([p.kind in (kinds.FRICTION, kinds.LOAD_FRICTION, kinds.MAX_TORQUE) for p in problem.parameters])
    if not own.any() or n > FEW:
        return []
    draws = norm.ppf(Sobol(n, rng=0).random(DRAWN))
    return [
        np.concatenate([np.where([p.kind != kinds.DELAY for p in problem.parameters], x, 0.0), np.zeros(m)])
        for x in draws
    ]


def _of_decay(problem: Calibrated) -> list[Array]:
    """The robot whose free decay has the frequency and the damping of the recordings', where these tell it."""
    z = np.zeros(len(problem.parameters) + len(problem.measurement.parameters))
    try:
        found = decay_factors(problem.measurement, problem.signals(z), [take.end for take in problem.takes])
    except (ShotError, SimulationFailure):
        return []
    if found is None:
        return []
    for k, p in enumerate(problem.parameters):
        if p.kind in STIFF or p.kind == kinds.DAMPING:
            factor = found[0] ** 2 if p.kind in STIFF else found[1]
            z[k] = np.clip(np.log(factor) / p.spread, -FARTHEST, FARTHEST)
    return [z]


def _common_noise(problem: Calibrated) -> Measurement:
    """The sensors with noise as large as a tenth of what they measured: the same for all robots, so that their losses
    compare."""

    def of(sensor: Sensor) -> Sensor:
        values = np.where(sensor.fitted, sensor.channel.values, np.nan)
        return replace(sensor, sigma=max(0.1 * float(np.nanmean(np.nanstd(values, axis=0))), sensor.sigma))

    return problem.measurement.with_sensors([of(sensor) for sensor in problem.measurement.sensors])
