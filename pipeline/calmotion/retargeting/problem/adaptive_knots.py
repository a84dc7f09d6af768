"""Knots where the motion needs them: halved intervals where a finer spline would gain something, and none where the
spline that was found has no use for one.

What a finer spline would gain is told by the gradient over it, which costs one adjoint sweep however many knots it has,
and the rigid robot's Gauss-Newton matrix; what the step by that matrix promises is assigned to the intervals whose
functions take part in it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import splu

from calmotion.retargeting.problem.offset_basis import OffsetBasis, basis_on, knot_frames, uniform_breaks
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.shot.character import Array, BoolArray, IntArray
from calmotion.simulation.inputs.time_grid import TimeGrid

FIRST, FINEST = 0.05, 1.0 / 60.0  # distance of knots to begin with, and least [s]
SHARE = 0.95  # of what finer knots would gain that the intervals that are halved must account for
USELESS = 1e-10  # jump of the third derivative at a knot, over the largest, that is rounding
FIT = 1e-7  # by how much an offset that the shot already carries may be off [rad or m]


def first_breaks(grid: TimeGrid) -> IntArray:
    """The frames that carry knots to begin with."""
    return uniform_breaks(grid, FIRST)


def halved(grid: TimeGrid, breaks: IntArray, intervals: BoolArray | None = None) -> IntArray:
    """Knots with more of them in the middle of some intervals, or of all, where frames and `FINEST` allow it."""
    middles = (breaks[:-1] + breaks[1:]) // 2
    frame = float(grid.frame_times[1] - grid.frame_times[0])
    wide = (np.diff(breaks) >= 2) & (np.diff(breaks) * frame >= 2.0 * FINEST - 1e-9)
    wanted = wide & np.isin(middles, knot_frames(grid))
    if intervals is not None:
        wanted &= intervals
    return np.union1d(breaks, middles[wanted]).astype(np.int32)


def wanted_breaks(
    problem: RetargetProblem, x: Array, fixed_on: Callable[[OffsetBasis], BoolArray], gain: float
) -> IntArray | None:
    """Finer knots for a problem that was linearised last at x; None where finer ones would gain too little.

    Args:
        fixed_on: Function from a basis to which of its coefficients stay as they are.
        gain: Fall of the root-mean-square error that finer knots must promise [m].
    """
    grid, basis = problem.grid, problem.space.basis
    breaks = halved(grid, basis.breaks)
    if len(breaks) == len(basis.breaks):
        return None
    finer = basis_on(grid, breaks, basis.kept_ends)
    fine = problem.on_basis(finer, carried(basis, finer, x, len(problem.space.motors)))
    fixed = fixed_on(fine.space.basis)
    gradient = np.where(fixed, 0.0, fine.gradient())
    promised = 0.5 * gradient * fine.precondition(fixed)(gradient)
    by_function = promised.reshape(fine.space.basis.count, -1).sum(axis=1)
    total = float(by_function.sum())
    if not total > 0.0 or problem.gain(total, problem.objective_value()) < gain:
        return None
    wanted = halved(grid, basis.breaks, _paying(grid, basis, fine.space.basis, np.maximum(by_function, 0.0)))
    return wanted if len(wanted) > len(basis.breaks) else None


def _paying(grid: TimeGrid, basis: OffsetBasis, fine: OffsetBasis, by_function: Array) -> BoolArray:
    """The intervals of a basis that account for most of what the functions of a finer one gain, shape [n - 1]."""
    centres = np.mod(fine.support.mean(axis=1), grid.end) if fine.wraps else fine.support.mean(axis=1)
    at = np.clip(np.searchsorted(basis.knots, centres, side="right") - 1, 0, len(basis.knots) - 2)
    by_interval = np.bincount(at, by_function, len(basis.knots) - 1)
    order = np.argsort(-by_interval)
    before = np.cumsum(by_interval[order]) - by_interval[order]
    paying = np.zeros(len(by_interval), bool)
    paying[order[before < SHARE * by_interval.sum()]] = True
    return paying


def carried(old: OffsetBasis, new: OffsetBasis, x: Array, motors: int) -> Array:
    """The same offsets in a basis that holds them, shape [P * m]."""
    return fitted(new, old.values @ x.reshape(old.count, motors)).ravel()


def fitted(basis: OffsetBasis, offsets: Array) -> Array:
    """Coefficients of the offsets nearest to given ones of shape [T, m], shape [P, m]."""
    normal = (basis.values.T @ basis.values).tocsc()
    solved: Array = splu(normal).solve(np.asarray(basis.values.T @ offsets))
    return solved


def breaks_for(grid: TimeGrid, kept_ends: bool, offsets: Array) -> IntArray:
    """Knots, finer by halving where that is needed, that hold offsets of shape [T, m]."""
    breaks = first_breaks(grid)
    while True:
        basis = basis_on(grid, breaks, kept_ends)
        error = np.abs(basis.values @ fitted(basis, offsets) - offsets).max(axis=1) if basis.count else np.ones(1)
        at = np.clip(np.searchsorted(basis.knots, grid.times, side="right") - 1, 0, len(breaks) - 2)
        worst = np.zeros(len(breaks) - 1)
        np.maximum.at(worst, at, error)
        finer = halved(grid, breaks, worst > FIT)
        if len(finer) == len(breaks):
            return breaks
        breaks = finer


def useful_knots(basis: OffsetBasis, coefficients: Array) -> Array:
    """Times of the knots at which a motor's offset is more than one cubic, the first and the last among them [s].

    Args:
        coefficients: Of the motor, shape [P].
    """
    # the third derivative of a cubic is that of its curvature between two knots
    curvature = basis.bend @ coefficients
    third = np.diff(curvature.reshape(-1, 2), axis=1)[:, 0] / (np.diff(basis.knots) / np.sqrt(3.0))
    jumps = np.abs(np.diff(third))
    useful = jumps > USELESS * np.max(jumps, initial=0.0)
    return basis.knots[np.concatenate([[True], useful, [True]])]
