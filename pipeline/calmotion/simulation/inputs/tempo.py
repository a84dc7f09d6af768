"""By how much a motion has to be slower for a rigid robot to keep the limits of its motors (formulation, section 11).

With z = (ds/dt)^2, where s is the animation's own time and t that of the performance, rates are theta' sqrt(z),
accelerations theta'' z + theta' z'/2 and efforts g + A z + B z'/2: linear in z and z'. The largest z under the limits
is the fastest performance (Verscheure et al., Time-optimal path tracking for robots, 2009; Pham and Pham, TOPP-RA,
2018), found by a linear programme, and a lower bound of the time that any performance of these curves takes.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog

from calmotion.arrays import Array, IntArray
from calmotion.model.outputs import Tempo, TooWeak


@dataclass(frozen=True, eq=False)
class MotorEfforts:
    """What the motors of a rigid robot have to do at each instant, shape [T, M] each.

    Attributes:
        at_rest: In its pose [N m].
        by_square: Times the square of the tempo [N m].
        by_change: Times half of the derivative of that square by the animation's time [N m s].
    """

    at_rest: Array
    by_square: Array
    by_change: Array


@dataclass(frozen=True, eq=False)
class TempoLimits:
    """Largest values of M motors, infinite where there is no limit, shape [M].

    Attributes:
        velocity, acceleration, jerk, effort: [rad/s], [rad/s^2], [rad/s^3], [N m] (m and N of sliders).
    """

    velocity: Array
    acceleration: Array
    jerk: Array
    effort: Array


TEMPO_LIMITS = ("velocity", "acceleration", "jerk", "effort")  # that a slower tempo helps to keep
INSTANTS, DISTANCE = 400, 1.0 / 120.0  # number of instants that is enough, or their distance [s] where it is longer
FINEST = 1e-9  # of a limit, by which it may be exceeded through rounding


def needed_tempo(
    times: Array, values: Array, limits: TempoLimits, efforts: MotorEfforts | None, fastest: float = 1.0
) -> Tempo:
    """How much slower a motion has to be.

    Args:
        times: Of the animation [s], shape [T], at equal distances.
        values: Of the motors [rad or m], shape [T, M].
        efforts: Of the rigid robot at the same instants; None where none is limited.
        fastest: Least stretch, below 1 where parts may be faster than they are animated.
    """
    curve = CubicSpline(times, values)
    uniform = _uniform([curve(times, order) for order in range(4)], limits, efforts)
    length = float(times[-1] - times[0])
    few = times[few_instants(times)]
    if uniform <= 1.0 + FINEST and fastest == 1.0:
        return Tempo(1.0, 0.0, 0.0, few, np.ones(len(few)))
    if not np.isfinite(uniform):
        weak = _too_weak(times, limits, efforts)
        return Tempo(np.inf, np.inf, np.inf, few, np.full(len(few), np.inf), weak)
    square = _fastest(few, curve, limits, _between(times, few, efforts), (fastest, 2.0 * uniform))
    root = np.sqrt(square)
    added = float(np.sum(np.diff(few) * (2.0 / (root[:-1] + root[1:]) - 1.0)))
    return Tempo(uniform, (uniform - 1.0) * length, added, few, 1.0 / root)


def few_instants(times: Array) -> IntArray:
    """Indices of as many of some instants at equal distances [s] as a tempo follows from, the last one among them."""
    stride = max(1, min(-(-len(times) // INSTANTS), int(DISTANCE / (times[1] - times[0]))))
    return np.unique(np.append(np.arange(0, len(times), stride), len(times) - 1))


def _uniform(derivatives: list[Array], limits: TempoLimits, efforts: MotorEfforts | None) -> float:
    found = 1.0
    for order, largest in ((1, limits.velocity), (2, limits.acceleration), (3, limits.jerk)):
        found = max(found, float(np.max(np.abs(derivatives[order]) / largest, initial=0.0)) ** (1.0 / order))
    if efforts is None:
        return found
    if np.any(np.abs(efforts.at_rest) >= limits.effort):
        return np.inf
    left = np.where(efforts.by_square > 0.0, limits.effort - efforts.at_rest, limits.effort + efforts.at_rest)
    return max(found, float(np.sqrt(np.max(np.abs(efforts.by_square) / left, initial=0.0))))


def _too_weak(times: Array, limits: TempoLimits, efforts: MotorEfforts | None) -> TooWeak | None:
    if efforts is None:
        return None
    needed = np.abs(efforts.at_rest)
    at, motor = np.unravel_index(np.argmax(needed / limits.effort), needed.shape)
    return TooWeak(int(motor), float(times[at]), float(needed[at, motor]))


def _between(times: Array, few: Array, efforts: MotorEfforts | None) -> MotorEfforts | None:
    """The efforts in the middle between the instants of the linear programme."""
    if efforts is None:
        return None
    middle = 0.5 * (few[:-1] + few[1:])
    parts = (efforts.at_rest, efforts.by_square, efforts.by_change)
    return MotorEfforts(*(CubicSpline(times, part)(middle) for part in parts))


def _fastest(
    times: Array,
    curve: CubicSpline,
    limits: TempoLimits,
    efforts: MotorEfforts | None,
    stretches: tuple[float, float],
) -> Array:
    """The largest squares of the tempo at T instants, between the inverse squares of two stretches."""
    most, least = stretches[0] ** -2, stretches[1] ** -2
    length, middle = np.diff(times)[:, None], 0.5 * (times[:-1] + times[1:])
    rate, acceleration = curve(middle, 1), curve(middle, 2)
    rows, bounds = [], []

    def keep(offset: Array, by_square: Array, by_change: Array, largest: Array) -> None:
        """|offset + by_square z + by_change z'/2| <= largest, in the middle of each interval."""
        limited = np.isfinite(largest)
        # z and z' in the middle, by both ends
        ends = [(0.5 * by_square + sign * 0.5 * by_change / length)[:, limited].ravel() for sign in (-1.0, 1.0)]
        count = len(ends[0])
        first = np.repeat(np.arange(len(middle)), int(limited.sum()))
        at = np.arange(count)
        matrix = sparse.csr_matrix(
            (np.concatenate(ends), (np.tile(at, 2), np.concatenate([first, first + 1]))), (count, len(times))
        )
        for sign in (1.0, -1.0):
            rows.append(sign * matrix)
            bounds.append((largest - sign * offset)[:, limited].ravel())

    still = np.zeros_like(rate)
    keep(still, acceleration, rate, limits.acceleration)
    if efforts is not None:
        keep(efforts.at_rest, efforts.by_square, efforts.by_change, limits.effort)
    with np.errstate(divide="ignore", over="ignore"):
        fast = np.min((limits.velocity / np.abs(curve(times, 1))) ** 2, axis=1, initial=most)
    found = linprog(
        -np.ones(len(times)),
        sparse.vstack(rows),
        np.concatenate(bounds),
        bounds=[(least, max(square, least)) for square in fast.tolist()],
        method="highs",
    )
    if found.x is None:
        raise ValueError(f"the linear programme of the tempo has no solution: {found.message}")
    return np.asarray(found.x)
