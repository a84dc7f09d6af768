"""Motor curves over time: the animator's tracks, the offset splines, the pre-roll, and the time grid they live on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, CubicSpline
from scipy.sparse import csr_matrix, diags

from ..shot.animation import Track
from ..shot.character import Array, BoolArray, IntArray

DEGREE = 3
MAX_STEP = 1.0 / 480.0
KNOT_SPACING = 0.05
PRE_ROLL = 1.0
AT_REST = 1e-3  # share of the shot's fastest motor below which a start counts as being at rest


@dataclass(frozen=True, eq=False)
class TimeGrid:
    """Steps of a simulation: frames are steps, and the pre-roll is a whole number of them.

    Attributes:
        frame_times: [s], shape [f], first 0.
        substeps: Steps in a frame.
        pre_steps: Steps of the pre-roll, at negative times.
        h: Step [s].
    """

    frame_times: Array
    substeps: int
    pre_steps: int
    h: float

    @property
    def times(self) -> Array:
        """Times of all instants [s], shape [T]."""
        total = self.pre_steps + (len(self.frame_times) - 1) * self.substeps + 1
        return np.asarray((np.arange(total) - self.pre_steps) * self.h, dtype=np.float64)

    @property
    def frames(self) -> IntArray:
        """Index of each frame among the instants, shape [f]."""
        return self.pre_steps + self.substeps * np.arange(len(self.frame_times), dtype=np.int32)

    @property
    def judged(self) -> BoolArray:
        """Which instants belong to the shot, shape [T]."""
        return np.arange(len(self.times)) >= self.pre_steps

    @property
    def pre_roll(self) -> float:
        """Length of the pre-roll [s]."""
        return self.pre_steps * self.h


def make_grid(frame_times: Array, step: float | None, pre_roll: float) -> TimeGrid:
    """The grid with the largest step that divides a frame and is no longer than asked for.

    Args:
        frame_times: [s], uniform, shape [f].
        step: Longest step [s]; None for 1/480 s, at which BDF2 keeps 10 Hz to better than a percent.
        pre_roll: [s], rounded up to whole steps.
    """
    frame = float(frame_times[1] - frame_times[0])
    substeps = max(1, math.ceil(frame / (step or MAX_STEP) - 1e-9))
    h = frame / substeps
    return TimeGrid(frame_times, substeps, math.ceil(pre_roll / h - 1e-9), h)


def interpolate(track: Track, end: float) -> CubicSpline:
    """The C2 cubic interpolant through a track's samples; constant outside them, as USD holds the value.

    The end conditions are not-a-knot where the samples cover the shot, so that a spline sampled at the frames is
    read back exactly; where the value is held before or after, the slope there is zero.

    Args:
        end: Last frame of the shot [s].
    """
    times, values = np.asarray(track.times, float), np.asarray(track.values, float)
    if len(times) == 1:
        times, values = np.array([times[0], times[0] + 1.0]), np.repeat(values, 2)
    held_before, held_after = times[0] > 1e-9, times[-1] < end - 1e-9
    left = (1, 0.0) if held_before else "not-a-knot"
    right = (1, 0.0) if held_after else "not-a-knot"
    if len(times) < 4 and not (held_before or held_after):
        return CubicSpline(times, values, bc_type="not-a-knot")
    if len(times) == 2 and (held_before != held_after):
        # one condition too many for a line: both ends at rest
        left = right = (1, 0.0)
    return CubicSpline(times, values, bc_type=(left, right))


def _held(spline: CubicSpline, times: Array) -> tuple[Array, Array]:
    first, last = spline.x[0], spline.x[-1]
    inside = np.clip(times, first, last)
    rate = spline(inside, 1)
    rate[(times < first) | (times > last)] = 0.0
    return spline(inside), rate


def pre_roll_weights(times: Array, length: float) -> tuple[Array, Array, Array]:
    """Values, rates and accelerations at times in [-length, 0) of the quintic that leaves rest and meets the curve
    at 0 in value, rate and acceleration; columns multiply these three. It starts half a rate times length back,
    where a constant acceleration would."""
    s = (times + length) / length
    start = 1 - 10 * s**3 + 15 * s**4 - 6 * s**5
    rate_end = -4 * s**3 + 7 * s**4 - 3 * s**5
    acceleration_end = 0.5 * s**3 - s**4 + 0.5 * s**5
    value = np.stack([np.ones_like(s), length * (rate_end - 0.5 * start), length**2 * acceleration_end], axis=1)
    d_start = (-30 * s**2 + 60 * s**3 - 30 * s**4) / length
    d_rate = (-12 * s**2 + 28 * s**3 - 15 * s**4) / length
    d_acceleration = (1.5 * s**2 - 4 * s**3 + 2.5 * s**4) / length
    rate = np.stack([np.zeros_like(s), length * (d_rate - 0.5 * d_start), length**2 * d_acceleration], axis=1)
    dd_start = -60 * s + 180 * s**2 - 120 * s**3
    dd_rate = -24 * s + 84 * s**2 - 60 * s**3
    dd_acceleration = 3 * s - 12 * s**2 + 10 * s**3
    bend = np.stack([np.zeros_like(s), (dd_rate - 0.5 * dd_start) / length, dd_acceleration], axis=1)
    return value, rate, bend


def sample_tracks(tracks: Sequence[Track], grid: TimeGrid) -> tuple[Array, Array]:
    """Angles [rad] and rates [rad/s] of all tracks at the grid's instants, shape [T, M], pre-roll included."""
    times, pre = grid.times, grid.pre_steps
    angles, rates = np.zeros((len(times), len(tracks))), np.zeros((len(times), len(tracks)))
    for k, track in enumerate(tracks):
        spline = interpolate(track, grid.frame_times[-1])
        angles[pre:, k], rates[pre:, k] = _held(spline, times[pre:])
        if pre:
            value, rate, _ = pre_roll_weights(times[:pre], grid.pre_roll)
            meet = np.array([angles[pre, k], rates[pre, k], float(spline(0.0, 2)) if spline.x[0] <= 0.0 else 0.0])
            angles[:pre, k], rates[:pre, k] = value @ meet, rate @ meet
    return angles, rates


def sample_accelerations(tracks: Sequence[Track], grid: TimeGrid) -> Array:
    """Accelerations [rad/s^2] of all tracks at the grid's instants, shape [T, M]; zero during a pre-roll."""
    times, pre = grid.times, grid.pre_steps
    out = np.zeros((len(times), len(tracks)))
    for k, track in enumerate(tracks):
        spline = interpolate(track, grid.frame_times[-1])
        inside = (times >= spline.x[0]) & (times <= spline.x[-1])
        inside[:pre] = False
        out[inside, k] = spline(times[inside], 2)
    return out


@dataclass(frozen=True, eq=False)
class Curves:
    """Motor curves at the instants: angles [rad], rates [rad/s], accelerations [rad/s^2], shape [T, M] each."""

    angles: Array
    rates: Array
    accelerations: Array


def sample_curves(tracks: Sequence[Track], grid: TimeGrid) -> Curves:
    """All of a shot's tracks at the grid's instants."""
    return Curves(*sample_tracks(tracks, grid), sample_accelerations(tracks, grid))


def needed_pre_roll(tracks: Sequence[Track], frame_times: Array) -> float:
    """Length of the pre-roll [s] that a shot needs for its tracks: none when they start at rest, else a second."""
    end = frame_times[-1]
    fine = np.linspace(0.0, end, 4 * len(frame_times))
    start, fastest = 0.0, 0.0
    for track in tracks:
        _, rate = _held(interpolate(track, end), fine)
        start, fastest = max(start, abs(rate[0])), max(fastest, float(np.max(np.abs(rate))))
    return 0.0 if start <= AT_REST * fastest else PRE_ROLL


@dataclass(frozen=True, eq=False)
class OffsetBasis:
    """Cubic B-splines of the offsets, the same for all motors.

    Attributes:
        knots: Break points [s], frames of the shot, shape [n].
        values, rates, accelerations: Basis and its derivatives at the grid's instants, sparse, shape [T, P].
        at_frames: Basis at the frames, sparse, shape [f, P].
        bending: Gram matrix of the second derivatives, pre-roll included, shape [P, P] [1/s^3].
        closeness: Gram matrix of the functions themselves, pre-roll included, shape [P, P] [s].
        support: First and last time at which each basis function acts [s], shape [P, 2]; the pre-roll counts as 0.
    """

    knots: Array
    values: csr_matrix
    rates: csr_matrix
    accelerations: csr_matrix
    at_frames: csr_matrix
    bending: csr_matrix
    closeness: csr_matrix
    support: Array

    @property
    def count(self) -> int:
        """Number of coefficients of one motor."""
        return self.values.shape[1]


def _breaks(frame_times: Array, spacing: float) -> Array:
    """Knots on frames, about `spacing` apart; never the second or the last but one frame, so that samples at the
    frames with not-a-knot ends hold the spline exactly."""
    last = len(frame_times) - 1
    stride = max(1, round(spacing / float(frame_times[1] - frame_times[0])))
    inner = [k for k in range(stride, last, stride) if 2 <= k <= last - 2]
    return frame_times[[0, *inner, last]]


def make_basis(grid: TimeGrid, spacing: float, kept_ends: bool) -> OffsetBasis:
    """Basis of the offsets on a grid.

    Args:
        spacing: Wanted distance of the knots [s].
        kept_ends: Whether the offset vanishes, with its slope, at the first and last frame.

    Slope and curvature are zero at the end, so that no motor is thrown in the last frames, where nothing that
    follows is judged; and at the start unless there is a pre-roll, since the system then starts at rest.
    """
    breaks = _breaks(grid.frame_times, spacing)
    knots = np.concatenate([np.repeat(breaks[0], DEGREE), breaks, np.repeat(breaks[-1], DEGREE)])
    count = len(knots) - DEGREE - 1
    eye = np.eye(count)
    splines = BSpline(knots, eye, DEGREE)
    merge = np.eye(count)
    if kept_ends:
        merge = merge[:, 2:-2]
    elif count <= 4:
        # too short for anything but a constant
        merge = np.ones((count, 1))
    else:
        # three equal coefficients at an end: zero slope and curvature there
        merge = merge[:, :-2]
        merge[-2:, -1] = 1.0
        if grid.pre_steps == 0:
            merge = merge[:, 2:]
            merge[:2, 0] = 1.0
    pre, times = grid.pre_steps, grid.times

    def sample(order: int) -> Array:
        inside = np.clip(times[pre:], breaks[0], breaks[-1])
        return splines(inside, nu=order) @ merge

    values, rates, accelerations = sample(0), sample(1), sample(2)
    # two Gauss points integrate the squared second derivative of a cubic exactly
    width = np.diff(breaks)[:, None]
    points = (0.5 * (breaks[:-1] + breaks[1:])[:, None] + 0.5 * width * np.array([-1, 1]) / math.sqrt(3)).ravel()
    bend = csr_matrix(splines(points, nu=2) @ merge)
    bending = bend.T @ diags(np.repeat(0.5 * width.ravel(), 2)) @ bend
    if pre:
        meet = np.stack([splines(0.0, nu=k) @ merge for k in range(3)])
        value, rate, curvature = pre_roll_weights(times[:pre], grid.pre_roll)
        values, rates = np.vstack([value @ meet, values]), np.vstack([rate @ meet, rates])
        accelerations = np.vstack([curvature @ meet, accelerations])
        bending = bending + csr_matrix(grid.h * (curvature @ meet).T @ (curvature @ meet))
    stored = csr_matrix(values)
    support = np.stack([knots[:count], knots[DEGREE + 1 :]], axis=1)
    columns = [np.flatnonzero(merge[:, k]) for k in range(merge.shape[1])]
    support = np.array([[support[rows, 0].min(), support[rows, 1].max()] for rows in columns])
    frames = grid.frames
    return OffsetBasis(
        breaks, stored, csr_matrix(rates), csr_matrix(accelerations), stored[frames], csr_matrix(bending),
        grid.h * (stored.T @ stored), support,
    )  # fmt: skip
