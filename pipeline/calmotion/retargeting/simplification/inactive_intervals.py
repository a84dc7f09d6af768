"""Inactive intervals of a shot: the search keeps the motor curves unchanged there.

They are determined before the search from a rigid robot. Where the rigid robot has almost no error to correct, an
offset could only serve the motion that follows, and such offsets begin within one period of the lowest frequency before
that motion. After the search, the gradient with respect to the omitted coefficients gives the gain that was missed; if
that gain matters, the search continues with all coefficients.

The gradient of the flexible robot is no criterion before the search: its adjoint decays backwards as slowly as the
vibration decays forwards, so it assigns a gain to offsets long before the vibration begins. After the search there is
no vibration.

An inactive interval at the start saves most, because every simulation shares its beginning with the first one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model import Simplification
from calmotion.retargeting.problem.adaptive_knots import halved
from calmotion.retargeting.problem.offset_basis import OffsetBasis
from calmotion.retargeting.problem.problem import Evaluation, RetargetProblem
from calmotion.retargeting.simplification.pruning import UNCHANGED
from calmotion.retargeting.solver.gauss_newton import Search
from calmotion.simulation.inputs.time_grid import TimeGrid

NEGLIGIBLE = 0.002  # share of the tolerance that the inactive intervals may gain together
PERIODS = 1.0  # distance of an inactive interval from active functions, in periods of the lowest frequency
SHORTEST = 0.25  # length of the shortest inactive interval [s]
FixedOn = Callable[[OffsetBasis], BoolArray]


@dataclass(frozen=True)
class InactiveInterval:
    """An interval of a shot in which the search changes no motor.

    Attributes:
        start, stop: [s].
        gain: Decrease of the root-mean-square error that offsets in the interval would bring [m]: of the rigid robot
            before the search, of the flexible robot after it.
    """

    start: float
    stop: float
    gain: float


def inactive_intervals(
    at: Evaluation, start: Array, frequency: float, tolerance: float, ranges: str = "auto"
) -> tuple[InactiveInterval, ...]:
    """The inactive intervals of a shot; none in a cyclic shot, or where no coefficient is active.

    Args:
        at: Zero, the input.
        start: Where the search begins, shape [n]; functions with an offset there are active.
        frequency: Lowest frequency of the character [Hz].
        tolerance: Acceptable error [m].
        ranges: "auto", or "on": there are no inactive intervals.
    """
    problem, grid, basis = at.problem, at.problem.grid, at.problem.space.basis
    if ranges == "on" or grid.cyclic or not frequency > 0.0:
        return ()
    gradient, own = at.rigid_gradient(), problem.rigid.preconditioner(problem.space, problem.objective.weights)
    own.factor(np.zeros(problem.size, bool))
    solved = own.solve(gradient)
    gains = 0.5 * np.abs(gradient * solved).reshape(basis.count, -1).sum(axis=1)
    # the same decrease of the objective is a larger part of the error once the error is smaller
    budget = at.merit_of_gain(NEGLIGIBLE * tolerance) * min(1.0, tolerance / max(at.error, tolerance))
    order = np.argsort(gains)
    active = np.any(np.abs(start).reshape(basis.count, -1) > UNCHANGED, axis=1)
    active[order[np.cumsum(gains[order]) > budget]] = True
    exceeding = grid.times[_exceeding(at)]
    away = PERIODS / frequency
    needed = np.concatenate([basis.support[active], np.stack([exceeding, exceeding], axis=1)]) + [-away, away]
    if not len(needed):
        return ()
    value = at.objective_value
    return tuple(
        InactiveInterval(a, b, problem.gain(float(gains[_acting(basis, a, b)].sum()), value))
        for a, b in _gaps(needed, grid.end)
        if b - a >= SHORTEST
    )


def _exceeding(at: Evaluation) -> BoolArray:
    """Instants at which a point exceeds a limit, shape [T]."""
    exceeded, limits = np.zeros(len(at.problem.grid.times), bool), at.problem.limits
    if limits is not None:
        for name, values in at.limited.items():
            exceeded |= np.any(limits.gradient(name, values) != 0.0, axis=1)
    return exceeded


def _gaps(intervals: Array, end: float) -> list[tuple[float, float]]:
    """The gaps that intervals of shape [n, 2] leave between 0 and the end."""
    gaps, reached = [], 0.0
    for first, last in intervals[np.argsort(intervals[:, 0])]:
        if first > reached:
            gaps.append((reached, float(first)))
        reached = max(reached, float(last))
    return [*gaps, (reached, end)] if reached < end else gaps


def _acting(basis: OffsetBasis, start: float, stop: float) -> BoolArray:
    """Which basis functions act in an interval, shape [P]."""
    first, last = basis.support.T
    acting: BoolArray = (first < stop) & (last > start)
    return acting


def inactive_coefficients(basis: OffsetBasis, intervals: Sequence[InactiveInterval], motors: int) -> BoolArray:
    """Which coefficients change a motor curve in any of the intervals, shape [P * m]."""
    inactive = np.zeros(basis.count, bool)
    for interval in intervals:
        inactive |= _acting(basis, interval.start, interval.stop)
    return np.repeat(inactive, motors)


def first_change(grid: TimeGrid, basis: OffsetBasis, fixed_on: FixedOn) -> int:
    """Index of an instant before which only fixed coefficients act, on these knots and on the next finer ones.

    Args:
        fixed_on: Maps a basis to its fixed coefficients, shape [n], bool.
    """

    def start_on(on: OffsetBasis) -> float:
        free = ~np.all(fixed_on(on).reshape(on.count, -1), axis=1)
        return float(np.min(on.support[free, 0], initial=grid.end))

    start = 0.0 if grid.cyclic else start_on(basis)
    if start > 0.0:
        start = min(start, start_on(basis.on(grid, halved(grid, basis.breaks))))
    if not start > 0.0:
        return 0
    return min(int(np.searchsorted(grid.times, start - 0.5 * grid.h)), len(grid.times) - 2)


def with_gains(
    problem: RetargetProblem, search: Search, intervals: Sequence[InactiveInterval], locked_on: FixedOn
) -> tuple[tuple[InactiveInterval, ...], Search]:
    """The intervals with their gains after a search, from one preconditioned gradient step of the linearised robot.

    Args:
        problem: Of the search, in which only what the shot locks is fixed.
        search: Where it ended.
        intervals: The inactive intervals.
        locked_on: Maps a basis to the coefficients that the shot locks, shape [n], bool.

    Returns:
        The intervals, and the search with this work counted.
    """
    basis, motors = problem.space.basis, len(problem.space.motors)
    at = problem.at(search.x, search.at)
    linear = at.linearized()
    fixed = ~inactive_coefficients(basis, intervals, motors) | locked_on(basis)
    gradient = np.where(fixed, 0.0, linear.gradient)
    step = linear.precondition(fixed, search.sharpened)(gradient)
    curvature = float(step @ linear.product(step))
    slopes = np.abs(gradient * step).reshape(basis.count, motors).sum(axis=1)
    total = 0.5 * float(gradient @ step) ** 2 / curvature if curvature > 0.0 else 0.0
    value = at.objective_value
    shares = [
        float(slopes[_acting(basis, r.start, r.stop)].sum()) / max(float(slopes.sum()), 1e-300) for r in intervals
    ]
    counted = replace(
        search, evaluations=search.evaluations + 1, gradients=search.gradients + 1, products=search.products + 1
    )
    measured = (replace(r, gain=problem.gain(share * total, value)) for r, share in zip(intervals, shares, strict=True))
    return tuple(measured), counted


def interval_rows(intervals: Sequence[InactiveInterval]) -> list[Simplification]:
    """The rows of the report about inactive intervals."""
    return [
        Simplification(
            f"inactive interval from {_seconds(math.ceil(100 * r.start))} to {_seconds(int(100 * r.stop))}",
            "changes there would gain almost nothing",
            r.gain,
        )
        for r in intervals
    ]


def _seconds(hundredths: int) -> str:
    return f"{hundredths / 100:.2f} s" if hundredths else "0 s"
