"""The time grid of a shot: its frames in steps, and the pre-roll before them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.model.curves import Sample

MAX_STEP = 1.0 / 480.0


@dataclass(frozen=True, eq=False)
class TimeGrid:
    """Steps of a simulation: frames are steps, and the pre-roll is a whole number of them.

    Attributes:
        frame_times: [s], shape [f], first 0.
        substeps: Steps in a frame.
        pre_steps: Steps of the pre-roll, at negative times.
        h: Step [s].
        cyclic: Whether the shot loops: its last frame is its first. Instants 0 and 1 are then the last two of the
            loop before (`dynamics.periodic`), the second of them the first frame.
        joined: Whether it is a window of a longer shot that goes on from an earlier one: the instants before its first
            frame, and that frame, are known.
        continues: Whether the shot goes on after its last frame.
    """

    frame_times: Array
    substeps: int
    pre_steps: int
    h: float
    cyclic: bool = False
    joined: bool = False
    continues: bool = False

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
        """Which instants belong to the shot, shape [T]; of a loop its first frame does as its last."""
        return np.arange(len(self.times)) >= self.pre_steps + self.cyclic

    @property
    def quadrature(self) -> Array:
        """Weights of the trapezoidal rule over the shot [s], shape [T]."""
        weights = np.where(self.judged, self.h, 0.0)
        if not self.cyclic:
            weights[[self.pre_steps, -1]] *= 0.5
        return weights

    @property
    def pre_roll(self) -> float:
        """Length of the pre-roll [s]; a shot that loops has none."""
        return 0.0 if self.cyclic else self.pre_steps * self.h

    @property
    def end(self) -> float:
        """Time of the last frame [s]: the length of a loop."""
        return float(self.frame_times[-1])


def make_grid(frame_times: Array, step: float | None, pre_roll: float, cyclic: bool = False) -> TimeGrid:
    """The grid with the largest step that divides a frame and is no longer than requested.

    Args:
        frame_times: [s], uniform, shape [f].
        step: Longest step [s]; None for 1/480 s, at which BDF2 keeps 10 Hz to better than a percent.
        pre_roll: [s], rounded up to whole steps; not of a shot that loops.
        cyclic: Whether the shot loops.
    """
    frame = float(frame_times[1] - frame_times[0])
    substeps = max(1, math.ceil(frame / (step or MAX_STEP) - 1e-9))
    h = frame / substeps
    return TimeGrid(frame_times, substeps, 1 if cyclic else math.ceil(pre_roll / h - 1e-9), h, cyclic)


def over_grid(grid: TimeGrid, sample: Sample) -> tuple[Array, Array, Array]:
    """Values, rates and accelerations of a curve at all instants, pre-roll included, shape [T, ...] each.

    Args:
        sample: The curve over the shot; over all times where the shot loops.
    """
    pre, times = 0 if grid.cyclic else grid.pre_steps, grid.times
    parts = [sample(times[pre:], order) for order in range(3)]
    if pre:
        meet = np.stack([part[0] for part in parts])
        weights = pre_roll_weights(times[:pre], grid.pre_roll)
        parts = [np.concatenate([np.tensordot(rows, meet, 1), part]) for rows, part in zip(weights, parts, strict=True)]
    return parts[0], parts[1], parts[2]


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
