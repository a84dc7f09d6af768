"""Adaptive knots: intervals between knots are halved where a finer spline would reduce the error.

The gain of a finer spline is estimated by one step with the gradient over all finer knots, which costs one adjoint
sweep, and the Gauss-Newton matrix of the rigid robot. The decrease that this step predicts is assigned to the intervals
in which its functions act. After the search, knots at which the offsets have no jump of the third derivative are
removed.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import splu

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.retargeting.problem.linear_problem import LinearProblem
from calmotion.retargeting.problem.offset_basis import OffsetBasis, basis_on, knot_frames, uniform_breaks
from calmotion.retargeting.problem.problem import Evaluation
from calmotion.simulation.inputs.time_grid import TimeGrid

FIRST, FINEST = 0.05, 1.0 / 60.0  # initial and smallest distance of knots [s]
SHARE = 0.95  # share of the gain of finer knots that the halved intervals must contribute
USELESS = 1e-10  # jump of the third derivative at a knot, relative to the largest, that is rounding
FIT = 1e-7  # largest error of the spline fit to offsets that the shot already contains [rad or m]


def first_breaks(grid: TimeGrid) -> IntArray:
    """The frames that carry the initial knots."""
    return uniform_breaks(grid, FIRST)


def halved(grid: TimeGrid, breaks: IntArray, intervals: BoolArray | None = None) -> IntArray:
    """Frames of the knots after halving some intervals, or all, where the frames and `FINEST` allow it."""
    middles = (breaks[:-1] + breaks[1:]) // 2
    frame = float(grid.frame_times[1] - grid.frame_times[0])
    wide = (np.diff(breaks) >= 2) & (np.diff(breaks) * frame >= 2.0 * FINEST - 1e-9)
    allowed = wide & np.isin(middles, knot_frames(grid))
    if intervals is not None:
        allowed &= intervals
    return np.union1d(breaks, middles[allowed]).astype(np.int32)


def refined_breaks(
    at: Evaluation, linear: LinearProblem, fixed_on: Callable[[OffsetBasis], BoolArray], gain: float
) -> IntArray | None:
    """Frames of finer knots; None where these would gain too little.

    Args:
        at, linear: A point, and the problem linearised there.
        fixed_on: Maps a basis to its fixed coefficients, shape [n], bool.
        gain: Smallest decrease of the root-mean-square error by finer knots [m].
    """
    grid, space = at.problem.grid, at.problem.space
    basis = space.basis
    breaks = halved(grid, basis.breaks)
    if len(breaks) == len(basis.breaks):
        return None
    finer = basis.on(grid, breaks)
    fine = linear.over(space.on_basis(finer), converted(basis, finer, at.x, len(space.motors)))
    fixed = fixed_on(finer)
    gradient = np.where(fixed, 0.0, fine.gradient)
    decrease = 0.5 * gradient * fine.precondition(fixed)(gradient)
    by_function = decrease.reshape(finer.count, -1).sum(axis=1)
    total = float(by_function.sum())
    if not total > 0.0 or at.gain(total) < gain:
        return None
    refined = halved(grid, basis.breaks, _contributing(grid, basis, finer, np.maximum(by_function, 0.0)))
    return refined if len(refined) > len(basis.breaks) else None


def _contributing(grid: TimeGrid, basis: OffsetBasis, fine: OffsetBasis, by_function: Array) -> BoolArray:
    """The intervals of a basis that contribute most of the gain of a finer one, shape [n - 1], bool."""
    centres = np.mod(fine.support.mean(axis=1), grid.end) if fine.wraps else fine.support.mean(axis=1)
    at = np.clip(np.searchsorted(basis.knots, centres, side="right") - 1, 0, len(basis.knots) - 2)
    by_interval = np.bincount(at, by_function, len(basis.knots) - 1)
    order = np.argsort(-by_interval)
    before = np.cumsum(by_interval[order]) - by_interval[order]
    contributing = np.zeros(len(by_interval), bool)
    contributing[order[before < SHARE * by_interval.sum()]] = True
    return contributing


def converted(old: OffsetBasis, new: OffsetBasis, x: Array, motors: int) -> Array:
    """Coefficients of the same offsets in a finer basis, shape [P * m]."""
    return fitted(new, old.values @ x.reshape(old.count, motors)).ravel()


def fitted(basis: OffsetBasis, offsets: Array) -> Array:
    """Least-squares coefficients, shape [P, m], of offsets of shape [T, m]."""
    normal = (basis.values.T @ basis.values).tocsc()
    solved: Array = splu(normal).solve(np.asarray(basis.values.T @ offsets))
    return solved


def breaks_for(grid: TimeGrid, kept_ends: bool, offsets: Array, allowed: float = FIT) -> IntArray:
    """Frames of knots whose splines reproduce offsets of shape [T, m], by halving where needed.

    Args:
        allowed: Largest error [rad or m].
    """
    breaks = first_breaks(grid)
    while True:
        basis = basis_on(grid, breaks, kept_ends)
        error = np.abs(basis.values @ fitted(basis, offsets) - offsets).max(axis=1) if basis.count else np.ones(1)
        at = np.clip(np.searchsorted(basis.knots, grid.times, side="right") - 1, 0, len(breaks) - 2)
        worst = np.zeros(len(breaks) - 1)
        np.maximum.at(worst, at, error)
        finer = halved(grid, breaks, worst > allowed)
        if len(finer) == len(breaks):
            return breaks
        breaks = finer


def useful_knots(basis: OffsetBasis, coefficients: Array) -> Array:
    """Times of the knots at which the offset of a motor changes its cubic, and of the first and last knot [s].

    Args:
        coefficients: Of the motor, shape [P].
    """
    # the third derivative of a cubic is that of its curvature between two knots
    curvature = basis.curvatures @ coefficients
    third = np.diff(curvature.reshape(-1, 2), axis=1)[:, 0] / (np.diff(basis.knots) / np.sqrt(3.0))
    jumps = np.abs(np.diff(third))
    useful = jumps > USELESS * np.max(jumps, initial=0.0)
    times: Array = basis.knots[np.concatenate([[True], useful, [True]])]
    return times
