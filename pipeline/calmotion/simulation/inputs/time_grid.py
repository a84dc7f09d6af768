"""The time grid of a shot: its frames in steps, the pre-roll before them, and parts of a shot in time."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.model import Animation, Character
from calmotion.model.character import contact_joints, switched_motors
from calmotion.model.curves import Sample, held_curve

MAX_STEP = 1.0 / 480.0
ORDERS = 4  # a curve and its first three derivatives
AFTER = 1e-6  # of a step, by which rounding does not move a time behind a knot
_QUINTIC = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [-0.5, 0.0, 0.0, 1.0, -0.5, 0.0], [0.0, 0.0, 0.0, 0.5, -1.0, 0.5]])


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
    """

    frame_times: Array
    substeps: int
    pre_steps: int
    h: float
    cyclic: bool = False

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


def over_grid(grid: TimeGrid, sample: Sample) -> tuple[Array, ...]:
    """A curve and its first derivatives by time at all instants, pre-roll included, `ORDERS` of shape [T, ...].

    Args:
        sample: The curve over the shot; over all times where the shot loops.
    """
    pre, times = 0 if grid.cyclic else grid.pre_steps, grid.times
    parts = [sample(after_knots(times[pre:], order, grid.h), order) for order in range(ORDERS)]
    if pre:
        meet = np.stack([part[0] for part in parts[:3]])
        weights = pre_roll_weights(times[:pre], grid.pre_roll)
        parts = [np.concatenate([np.tensordot(rows, meet, 1), part]) for rows, part in zip(weights, parts, strict=True)]
    return tuple(parts)


def after_knots(times: Array, order: int, h: float) -> Array:
    """Times at which to sample a derivative: the third one of a cubic jumps at knots, and counts as it is after them.

    Args:
        times: On a grid of step h [s], some of them on knots but for rounding.
    """
    return times + AFTER * h if order > 2 else times


def pre_roll_weights(times: Array, length: float) -> tuple[Array, ...]:
    """The quintic that leaves rest and meets a curve at 0 in value, rate and acceleration, and its first derivatives,
    `ORDERS` in all, at times in [-length, 0); columns multiply these three. It starts half a rate times length back,
    where a constant acceleration would."""
    s = (times + length) / length
    return tuple(
        np.stack([length ** (k - order) * polyval(s, polyder(part, order)) for k, part in enumerate(_QUINTIC)], axis=1)
        for order in range(ORDERS)
    )


_BRIEF = 0.25  # time over which accelerations are averaged: that of a move [s]


def later(animation: Animation, start: float, frame_times: Array) -> Animation:
    """An animation from a time on; nothing of it is cut off, so that its curves are the same to the last digit.

    Args:
        start: [s].
        frame_times: Of the frames after it, shape [f], first 0.
    """
    if start == 0.0:
        return replace(animation, frame_times=frame_times)
    tracks = tuple(
        replace(track, times=track.times - start, corners=track.corners - start) for track in animation.tracks
    )
    weights = tuple(replace(weight, times=weight.times - start) for weight in animation.weights)
    free = tuple(replace(free, times=free.times - start) for free in animation.free)
    moving = tuple(replace(frame, times=frame.times - start) for frame in animation.moving)
    return Animation(frame_times, tracks, tracks, moving, weights, free)


def busiest(character: Character, animation: Animation, seconds: float) -> Animation:
    """The part of a shot of so many seconds around the largest accelerations of the motors, as they were animated.

    The animation itself where it is no longer, where it loops, and where feet come and go or motors are switched: what
    stands, and where, follows from all that was before.
    """
    times = animation.frame_times
    changing = contact_joints(character) or switched_motors(character)
    if len(times) < 2 or times[-1] <= seconds or not animation.tracks or character.retarget.cyclic or changing:
        return animation
    values = np.stack([held_curve(track, times[-1])(times, 2) for track in animation.tracks], axis=1)
    shares = values / np.maximum(np.abs(values).max(axis=0), 1e-12)  # a slide and a hinge count alike
    brief = max(1, round(_BRIEF / times[1]))
    means = np.convolve(np.sum(shares**2, axis=1), np.ones(brief), "same")
    count = round(seconds / times[1])
    first = int(np.clip(int(np.argmax(means)) - count // 2, 0, len(times) - 1 - count))
    return later(animation, float(times[first]), times[: count + 1])
