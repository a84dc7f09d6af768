"""Cubic B-splines of the offsets that are added to the motor curves."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import csc_matrix, csr_matrix, diags, eye_array, hstack, vstack

from calmotion.arrays import Array, IntArray
from calmotion.simulation.inputs.time_grid import ORDERS, TimeGrid, after_knots, pre_roll_weights

DEGREE = 3
AT_ONCE = 512  # times at which splines are evaluated at once: all but those that act there are left out


@dataclass(frozen=True, eq=False)
class OffsetBasis:
    """Cubic B-splines of the offsets, the same for all motors.

    Attributes:
        breaks: Frames that carry a knot, shape [n].
        knots: Their times [s], shape [n].
        derivatives: Basis and its first derivatives at the grid's instants, sparse, shape [T, P] each.
        at_frames: Basis at the frames, sparse, shape [f, P].
        curvatures: Second derivatives at the two Gauss points of each interval between knots, shape [2 (n - 1), P].
        curvature_gram: Gram matrix of the second derivatives, pre-roll included, shape [P, P] [1/s^3].
        closeness: Gram matrix of the functions themselves, pre-roll included, shape [P, P] [s].
        support: First and last time at which each basis function acts [s], shape [P, 2]; the pre-roll counts as 0.
            In a cyclic shot it may begin before 0: it then also acts at the end.
        wraps: Whether the last functions are neighbours of the first.
        kept_ends: Whether the offset vanishes at the first and last frame.
        moving_end: Whether slope and curvature at the end may change, see `basis_on`.
    """

    breaks: IntArray
    knots: Array
    derivatives: tuple[csr_matrix, ...]
    at_frames: csr_matrix
    curvatures: csr_matrix
    curvature_gram: csr_matrix
    closeness: csr_matrix
    support: Array
    wraps: bool
    kept_ends: bool
    moving_end: bool

    @property
    def values(self) -> csr_matrix:
        """The basis at the instants, shape [T, P]."""
        return self.derivatives[0]

    @property
    def rates(self) -> csr_matrix:
        """Its first derivatives."""
        return self.derivatives[1]

    @property
    def accelerations(self) -> csr_matrix:
        """Its second derivatives."""
        return self.derivatives[2]

    @property
    def count(self) -> int:
        """Number of coefficients of one motor."""
        return int(self.values.shape[1])

    def on(self, grid: TimeGrid, breaks: IntArray) -> OffsetBasis:
        """The basis with the same ends on other knots."""
        return basis_on(grid, breaks, self.kept_ends, self.moving_end)


def knot_frames(grid: TimeGrid) -> IntArray:
    """Frames that may carry an inner knot.

    The second frame and the last but one are excluded, so that the interpolant of the frames with not-a-knot ends
    reproduces the spline exactly. The periodic interpolant of a cyclic shot allows all frames.
    """
    margin, last = 1 if grid.cyclic else 2, len(grid.frame_times) - 1
    return np.arange(margin, last - margin + 1, dtype=np.int32)


def uniform_breaks(grid: TimeGrid, spacing: float) -> IntArray:
    """Frames about `spacing` [s] apart, the first and the last among them."""
    last, allowed = len(grid.frame_times) - 1, knot_frames(grid)
    stride = max(1, round(spacing / float(grid.frame_times[1] - grid.frame_times[0])))
    inner = allowed[allowed % stride == 0]
    return np.array([0, *inner, last], np.int32)


def make_basis(grid: TimeGrid, spacing: float, kept_ends: bool) -> OffsetBasis:
    """`basis_on` knots about `spacing` [s] apart."""
    return basis_on(grid, uniform_breaks(grid, spacing), kept_ends)


def basis_on(grid: TimeGrid, breaks: IntArray, kept_ends: bool, moving_end: bool = False) -> OffsetBasis:
    """Basis of the offsets on a grid.

    Args:
        breaks: Frames that carry a knot, ascending, the first and the last among them.
        kept_ends: Whether the offset vanishes, with its slope, at the first and last frame.
        moving_end: Whether slope and curvature at the end may change all the same, since limits are exceeded there.

    Slope and curvature are zero at the end: errors after the last frame have no weight, so offsets could otherwise
    accelerate motors there. They are zero at the start if there is no pre-roll, because the system starts at rest.
    Offsets of a cyclic shot are periodic; if the end poses are kept, their curvature is zero at the seam.
    """
    knots = grid.frame_times[breaks]
    wraps = grid.cyclic and not kept_ends and len(knots) > 4
    padded, merge, support = (_periodic if wraps else _open)(knots)
    if not wraps:
        merge = _ends(merge, kept_ends, grid, moving_end)
        columns = [merge.indices[start:stop] for start, stop in zip(merge.indptr[:-1], merge.indptr[1:], strict=True)]
        support = np.array([[support[rows, 0].min(), support[rows, 1].max()] for rows in columns]).reshape(-1, 2)

    def sample(times: Array, order: int) -> csr_matrix:
        inside = np.mod(times, grid.end) if grid.cyclic else np.clip(times, knots[0], knots[-1])
        return _merged(_evaluated(padded, inside, order), merge)

    derivatives = _over_grid(grid, sample)
    stored = derivatives[0]
    # two Gauss points integrate the squared second derivative of a cubic exactly
    width = np.diff(knots)[:, None]
    points = (0.5 * (knots[:-1] + knots[1:])[:, None] + 0.5 * width * np.array([-1, 1]) / math.sqrt(3)).ravel()
    curvatures = sample(points, 2)
    curvature_gram = curvatures.T @ diags(np.repeat(0.5 * width.ravel(), 2)) @ curvatures
    near = stored[grid.judged] if grid.cyclic else stored
    if not grid.cyclic and grid.pre_steps:
        before = derivatives[2][: grid.pre_steps]
        curvature_gram = curvature_gram + grid.h * (before.T @ before)
    return OffsetBasis(
        breaks, knots, derivatives, stored[grid.frames], curvatures, csr_matrix(curvature_gram),
        grid.h * (near.T @ near), support, wraps, kept_ends, moving_end,
    )  # fmt: skip


def _evaluated(padded: Array, times: Array, order: int) -> csr_matrix:
    """Splines on knots of shape [n + 4], or derivatives of them, at times of shape [T]; shape [T, n].

    Successive times are evaluated together, with those splines alone that act there: memory and time grow with the
    length of a shot, not with its square.
    """
    count = len(padded) - DEGREE - 1
    interval = np.clip(np.searchsorted(padded, times, side="right") - 1, DEGREE, count - 1)
    parts = []
    for start in range(0, len(times), AT_ONCE):
        near = interval[start : start + AT_ONCE]
        first, last = int(near.min()) - DEGREE, int(near.max()) + 1
        splines = BSpline(padded[first : last + DEGREE + 1], np.eye(last - first), DEGREE)
        part = csr_matrix(splines(times[start : start + AT_ONCE], nu=order))
        parts.append(csr_matrix((part.data, part.indices + first, part.indptr), (part.shape[0], count)))
    return csr_matrix(vstack(parts)) if parts else csr_matrix((0, count))


def _merged(values: csr_matrix, merge: csc_matrix) -> csr_matrix:
    """Combinations of columns, without entries that are zero."""
    found = csr_matrix(values @ merge)
    found.eliminate_zeros()
    found.sort_indices()
    return found


def _over_grid(grid: TimeGrid, sample: Callable[[Array, int], csr_matrix]) -> tuple[csr_matrix, ...]:
    """As `time_grid.over_grid`, sparse."""
    pre, times = 0 if grid.cyclic else grid.pre_steps, grid.times
    parts = [sample(after_knots(times[pre:], order, grid.h), order) for order in range(ORDERS)]
    if pre:
        meet = np.concatenate([part[:1].toarray() for part in parts[:3]])
        columns = np.flatnonzero(np.any(meet, axis=0))  # a few act where the pre-roll ends
        weights = pre_roll_weights(times[:pre], grid.pre_roll)
        for k, rows in enumerate(weights):
            dense = csr_matrix(rows @ meet[:, columns])
            before = csr_matrix((dense.data, columns[dense.indices], dense.indptr), (pre, meet.shape[1]))
            parts[k] = csr_matrix(vstack([before, parts[k]]))
    return tuple(parts)


def _open(knots: Array) -> tuple[Array, csc_matrix, Array]:
    """Knots of the B-splines between the first and the last knot, the identity, and where each acts."""
    padded = np.concatenate([np.repeat(knots[0], DEGREE), knots, np.repeat(knots[-1], DEGREE)])
    count = len(padded) - DEGREE - 1
    support = np.stack([padded[:count], padded[DEGREE + 1 :]], axis=1)
    return padded, csc_matrix(eye_array(count)), support


def _periodic(knots: Array) -> tuple[Array, csc_matrix, Array]:
    """The same for a cyclic shot: functions that extend beyond the end continue at the start."""
    length, inner = knots[-1] - knots[0], len(knots) - 1
    padded = np.concatenate([knots[inner - DEGREE : -1] - length, knots, knots[1 : DEGREE + 1] + length])
    count = inner + DEGREE
    support = np.stack([padded[:inner], padded[DEGREE + 1 : inner + DEGREE + 1]], axis=1)
    return padded, csc_matrix(csr_matrix(eye_array(inner))[np.arange(count) % inner]), support


def _ends(merge: csc_matrix, kept_ends: bool, grid: TimeGrid, moving_end: bool) -> csc_matrix:
    """Combinations of open B-splines that satisfy the end conditions, as columns of the identity and sums of them."""
    count = merge.shape[0]
    if kept_ends:
        order = 3 if grid.cyclic else 2
        return merge[:, order:-order]
    if count <= 4 or grid.cyclic:
        # too short for anything but a constant
        return csc_matrix(np.ones((count, 1)))
    if not moving_end:
        merge = _level_end(merge)
    if grid.pre_steps == 0:
        merge = _level_start(merge)
    return merge


def _level_start(merge: csc_matrix) -> csc_matrix:
    """Three equal coefficients at the start: zero slope and curvature there."""
    return csc_matrix(hstack([csc_matrix(merge[:, :3].sum(axis=1)), merge[:, 3:]]))


def _level_end(merge: csc_matrix) -> csc_matrix:
    """The same at the end."""
    return csc_matrix(hstack([merge[:, :-3], csc_matrix(merge[:, -3:].sum(axis=1))]))
