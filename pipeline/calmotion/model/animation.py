"""The animation of a shot: a sampled track for each motor, and the frames."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model.tempo import TimeMap


@dataclass(frozen=True, eq=False)
class Track:
    """The authored samples of one motor.

    Attributes:
        times: [s] after the first frame of the shot, strictly increasing, shape [k]. May start before 0 or end
            after the last frame when the animation does.
        values: [rad] (or [m] of a length motor), shape [k], not wrapped.
        corners: Times among these at which the curve may have a corner, as a spline was authored; smooth elsewhere.
    """

    times: Array
    values: Array
    corners: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, eq=False)
class MotorTracks:
    """Tracks that are given in addition to the shot, such as a motion capture.

    Attributes:
        origin: Where they come from, for messages.
        times: [s] after the first frame of the shot, strictly increasing, shape [k].
        values: By the path of the motor's joint, or by its name where that is the only one, shape [k].
        units: Their units, where they are said: `rad`, `deg`, `m`, `cm` or `mm`.
        angle_unit: `rad` or `deg`, of the other angles; other lengths are in m.
    """

    origin: str
    times: Array
    values: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=dict)
    angle_unit: str = "rad"


@dataclass(frozen=True, eq=False)
class MovingFrame:
    """The world-side frame of a joint, where the shot moves it (a moving root).

    Attributes:
        joint: Index of the joint.
        times: [s] after the first frame of the shot, strictly increasing, shape [k].
        positions: [m], world, shape [k, 3].
        rotations: Unit quaternions (w, x, y, z), world, neighbours of the same sign, shape [k, 4].
    """

    joint: int
    times: Array
    positions: Array
    rotations: Array


@dataclass(frozen=True, eq=False)
class WeightTrack:
    """How a weight of a target changes in time, linear between samples and held outside them.

    Attributes:
        target: Index of the target.
        rotation: Whether it is the weight of the rotation instead of the position.
        times: [s] after the first frame of the shot, strictly increasing, shape [k].
        values: Weights, not negative, shape [k].
    """

    target: int
    rotation: bool
    times: Array
    values: Array


@dataclass(frozen=True, eq=False)
class Schedule:
    """When something holds that comes and goes.

    Attributes:
        times: [s] after the first frame of the shot, strictly increasing, shape [k].
        active: Whether it holds from each time on, and before the first as from it, shape [k], bool.
    """

    times: Array
    active: BoolArray

    @property
    def changes(self) -> bool:
        """Whether it comes or goes at all."""
        return len(set(self.active.tolist())) > 1

    def holds_at(self, time: float) -> bool:
        """Whether it holds from a time [s] on."""
        return bool(self.held(np.array([time + 1e-9]))[0])

    def held(self, times: Array) -> BoolArray:
        """Whether it holds at each of some times [s], none of which is one at which it comes or goes."""
        at = np.maximum(np.searchsorted(self.times, times, "right") - 1, 0)
        held: BoolArray = self.active[at]
        return held


@dataclass(frozen=True, eq=False)
class FreeTrack(Schedule):
    """When a motor's curve may be changed.

    Attributes:
        motor: Index of the motor.
    """

    motor: int = -1

    def locked(self, end: float) -> list[tuple[float, float]]:
        """The ranges of the shot, up to its end [s], in which the curve is kept."""
        starts = [-np.inf, *self.times[1:]]
        ends = [*self.times[1:], np.inf]
        return [
            (max(start, 0.0), min(stop, end))
            for start, stop, active in zip(starts, ends, self.active, strict=True)
            if not active and start < end and stop > 0.0
        ]


@dataclass(frozen=True, eq=False)
class Animation:
    """The motion of a shot.

    Attributes:
        frame_times: Times of the shot's frames [s] after the first one, shape [f], first 0.
        tracks: One for each motor of the character, in its order: the intended motion.
        current: The tracks with earlier results applied, where the shot carries results of Calmotion
            (`simulate`, the start of `optimize`); otherwise the same object as `tracks`.
        moving: Moving roots, none for a character with a fixed root.
        weights: Weights of targets that change in time; the others are those of `Target`.
        free: When motors may be changed, where that changes in time.
        tempo: At which it is performed, so that times are the performance's; None: that of the shot as it was made.
    """

    frame_times: Array
    tracks: tuple[Track, ...]
    current: tuple[Track, ...]
    moving: tuple[MovingFrame, ...] = ()
    weights: tuple[WeightTrack, ...] = ()
    free: tuple[FreeTrack, ...] = ()
    tempo: TimeMap | None = None


@dataclass(frozen=True, eq=False)
class Contact(Schedule):
    """When a joint to the world holds: a foot that stands, a hand that holds on.

    Attributes:
        friction: Coefficient of friction with the ground; -1: not known.
    """

    friction: float = -1.0
