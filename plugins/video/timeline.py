"""What a video shows when: the shot in real time, then its worst moment in slow motion, seen from near."""

from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Result, Simulation

BEFORE_WORST, AFTER_WORST = 0.30, 0.40  # of the slow motion [s of the shot]
APPROACH = 0.7  # time in which the camera comes near [s of the video]
STAY = 1.2  # time that the worst moment stays [s of the video]


@dataclass(frozen=True)
class Moment:
    """One frame of a video.

    Attributes:
        time: In the shot [s].
        near: How near the camera is: 0 sees the whole motion, 1 the worst target alone.
        speed: Of the time; 0 where it stands still.
    """

    time: float
    near: float
    speed: float


@dataclass(frozen=True)
class Worst:
    """The moment of the largest error of the motion as animated.

    Attributes:
        time: [s].
        target: Index of the target, -1 where there is none.
    """

    time: float
    target: int


def largest_errors(run: Simulation) -> Array:
    """Largest position error of all targets at each judged step [m], shape [t]."""
    return np.asarray(run.position_errors[run.motion.judged].max(axis=1, initial=0.0))


def worst_moment(result: Result) -> Worst:
    """When, and at which target, the motion as animated has its largest error."""
    run = result.before
    errors = run.position_errors[run.motion.judged]
    if not errors.size or errors.max() <= 0.0:
        return Worst(0.0, -1)
    row, target = np.unravel_index(int(np.argmax(errors)), errors.shape)
    return Worst(float(run.motion.times[run.motion.judged][row]), int(target))


def moments(start: float, end: float, worst: Worst, rate: float, slow: float) -> list[Moment]:
    """The frames of a video.

    Args:
        start, end: Of the shot [s].
        worst: Its worst moment.
        rate: Frames per second.
        slow: Speed of the slow motion; at 1 there is none.
    """
    frames = [Moment(float(t), 0.0, 1.0) for t in np.arange(start, end + 0.5 / rate, 1.0 / rate).clip(start, end)]
    if worst.target < 0 or slow >= 1.0:
        return frames
    first, last = max(worst.time - BEFORE_WORST, start), min(worst.time + AFTER_WORST, end)
    approach = max(round(APPROACH * rate), 1)
    frames += [Moment(first, ease(k / approach), 0.0) for k in range(1, approach + 1)]
    step = slow / rate
    frames += [Moment(float(t), 1.0, slow) for t in np.arange(first + step, worst.time, step)]
    frames += [Moment(worst.time, 1.0, 0.0)] * round(STAY * rate)
    frames += [Moment(float(t), 1.0, slow) for t in np.arange(worst.time + step, last + 0.5 * step, step).clip(max=end)]
    return frames


def ease(share: float) -> float:
    """A smooth passage from 0 to 1."""
    return share * share * (3.0 - 2.0 * share)
