"""Ranges of a shot in which its motors need no change, found before the search and left out of it.

Where a rigid robot would have next to nothing to correct, offsets would only be there to act on what comes later. How
much later follows from the lowest frequency: offsets that prepare a motion begin within a period before it. At the end
of the search the gradient over the coefficients that were left out tells what they would have gained; where that
matters the search goes on with them.

The gradient of the flexible robot would not do at the start: it tells that a shake could be stopped long before it
begins, as its adjoint dies away backwards as slowly as the shake does forwards. At the end there is no shake.

Most is saved by a beginning that stays as it is: its simulation is known from the first one on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.retargeting.problem.adaptive_knots import halved
from calmotion.retargeting.problem.offset_basis import OffsetBasis, basis_on
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.simplification.pruning import UNCHANGED
from calmotion.retargeting.solver.gauss_newton import Search
from calmotion.shot import Simplification
from calmotion.shot.character import Array, BoolArray
from calmotion.simulation.inputs.time_grid import TimeGrid

QUIET = 0.002  # of the tolerance: what ranges that are left out may promise together
PERIODS = 1.0  # of the lowest frequency, by which a range keeps away from what is not quiet
SHORTEST = 0.25  # range that is left out [s]
FixedOn = Callable[[OffsetBasis], BoolArray]


@dataclass(frozen=True)
class InactiveInterval:
    """A range of a shot in which no motor is to change.

    Attributes:
        start, stop: [s].
        gain: By how much the root-mean-square error would fall with changes there [m]: as a rigid robot's would before
            the search, as the robot's own would after it.
    """

    start: float
    stop: float
    gain: float


def inactive_intervals(
    problem: RetargetProblem, start: Array, frequency: float, tolerance: float, ranges: str = "auto"
) -> tuple[InactiveInterval, ...]:
    """The ranges that a search may leave out; none in a shot that loops, or that is quiet throughout.

    Args:
        problem: Evaluated last at zero, the input.
        start: Where the search begins, shape [n]; a range that is changed there is not quiet.
        frequency: The lowest one of the character [Hz].
        tolerance: Error that does not matter [m].
        ranges: "auto", or "on": all of the shot is searched.
    """
    grid, basis = problem.grid, problem.space.basis
    if ranges == "on" or grid.cyclic or not frequency > 0.0:
        return ()
    gradient = problem.rigid_gradient()
    solved = problem.precondition(np.zeros(problem.size, bool))(gradient)
    promised = 0.5 * np.abs(gradient * solved).reshape(basis.count, -1).sum(axis=1)
    # what is worth so much now is worth more when the error has fallen
    budget = problem.worth(QUIET * tolerance) * min(1.0, tolerance / max(problem.error, tolerance))
    order = np.argsort(promised)
    loud = np.any(np.abs(start).reshape(basis.count, -1) > UNCHANGED, axis=1)
    loud[order[np.cumsum(promised[order]) > budget]] = True
    exceeding = grid.times[_exceeding(problem)]
    away = PERIODS / frequency
    intervals = np.concatenate([basis.support[loud], np.stack([exceeding, exceeding], axis=1)]) + [-away, away]
    if not len(intervals):
        return ()
    value = problem.objective_value()
    return tuple(
        InactiveInterval(a, b, problem.gain(float(promised[_acting(basis, a, b)].sum()), value))
        for a, b in _gaps(intervals, grid.end)
        if b - a >= SHORTEST
    )


def _exceeding(problem: RetargetProblem) -> BoolArray:
    """Instants at which the point evaluated last exceeds a limit, shape [T]."""
    found, limits = np.zeros(len(problem.grid.times), bool), problem.limits
    if limits is not None:
        for name, values in problem.limited.items():
            found |= np.any(limits.gradient(name, values) != 0.0, axis=1)
    return found


def _gaps(intervals: Array, end: float) -> list[tuple[float, float]]:
    """What intervals, shape [n, 2], leave of the time from 0 to the end."""
    found, reached = [], 0.0
    for first, last in intervals[np.argsort(intervals[:, 0])]:
        if first > reached:
            found.append((reached, float(first)))
        reached = max(reached, float(last))
    return [*found, (reached, end)] if reached < end else found


def _acting(basis: OffsetBasis, start: float, stop: float) -> BoolArray:
    """Which functions act in a range, shape [P]."""
    first, last = basis.support.T
    return (first < stop) & (last > start)


def left_out_on(basis: OffsetBasis, ranges: Sequence[InactiveInterval], motors: int) -> BoolArray:
    """Coefficients that would change a motor's curve in any of the ranges, shape [P * m]."""
    found = np.zeros(basis.count, bool)
    for item in ranges:
        found |= _acting(basis, item.start, item.stop)
    return np.repeat(found, motors)


def first_change(grid: TimeGrid, basis: OffsetBasis, fixed_on: FixedOn) -> int:
    """An instant before which no coefficient acts that is not fixed, on these knots and on those halfway between.

    Args:
        fixed_on: Function from a basis to which of its coefficients stay as they are.
    """

    def start_on(some: OffsetBasis) -> float:
        free = ~np.all(fixed_on(some).reshape(some.count, -1), axis=1)
        return float(np.min(some.support[free, 0], initial=grid.end))

    start = 0.0 if grid.cyclic else start_on(basis)
    if start > 0.0:
        start = min(start, start_on(basis_on(grid, halved(grid, basis.breaks), basis.kept_ends)))
    if not start > 0.0:
        return 0
    return min(int(np.searchsorted(grid.times, start - 0.5 * grid.h)), len(grid.times) - 2)


def with_gains(
    problem: RetargetProblem, search: Search, ranges: Sequence[InactiveInterval], locked_on: FixedOn
) -> tuple[tuple[InactiveInterval, ...], Search]:
    """The ranges with what changes in them would gain after a search, by one step of the linearised robot; the search
    counts the work. Leaves the problem with nothing held but what is locked.

    Args:
        locked_on: Function from a basis to which of its coefficients may not change at all.
    """
    basis, motors = problem.space.basis, len(problem.space.motors)
    problem.hold(first_change(problem.grid, basis, locked_on))
    problem.value(search.x)
    kept = ~left_out_on(basis, ranges, motors) | locked_on(basis)
    gradient = np.where(kept, 0.0, problem.linearize())
    step = problem.precondition(kept)(gradient)
    curvature = float(step @ problem.product(step))
    slopes = np.abs(gradient * step).reshape(basis.count, motors).sum(axis=1)
    whole = 0.5 * float(gradient @ step) ** 2 / curvature if curvature > 0.0 else 0.0
    value = problem.objective_value()
    shares = [float(slopes[_acting(basis, r.start, r.stop)].sum()) / max(float(slopes.sum()), 1e-300) for r in ranges]
    counted = replace(
        search, evaluations=search.evaluations + 1, gradients=search.gradients + 1, products=search.products + 1
    )
    found = (replace(r, gain=problem.gain(share * whole, value)) for r, share in zip(ranges, shares, strict=True))
    return tuple(found), counted


def quiet_rows(ranges: Sequence[InactiveInterval]) -> list[Simplification]:
    """What the user is told of them."""
    return [
        Simplification(
            f"inactive interval from {_seconds(math.ceil(100 * item.start))} to {_seconds(int(100 * item.stop))}",
            "changes there would gain almost nothing",
            item.gain,
        )
        for item in ranges
    ]


def _seconds(hundredths: int) -> str:
    return f"{hundredths / 100:.2f} s" if hundredths else "0 s"
