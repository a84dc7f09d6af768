"""What the animator authored: a sampled track for each motor, and the shot's frames."""

from __future__ import annotations

from dataclasses import dataclass

from .character import Array


@dataclass(frozen=True, eq=False)
class Track:
    """The authored samples of one motor.

    Attributes:
        times: [s] after the first frame of the shot, strictly increasing, shape [k]. May start before 0 or end
            after the last frame when the animation does.
        values: [rad] (or [m] of a length motor), shape [k], not wrapped.
    """

    times: Array
    values: Array


@dataclass(frozen=True, eq=False)
class MovingFrame:
    """The world-side frame of a joint, where the shot moves it: what a moving root hangs from.

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
class Animation:
    """The motion of a shot.

    Attributes:
        frame_times: Times of the shot's frames [s] after the first one, shape [f], first 0.
        tracks: One for each motor of the character, in its order: the animator's intent.
        current: The same where the shot already carries a layer of ours and the user asks for what is composed
            (`simulate`, the start of `optimize`); otherwise the same object as `tracks`.
        moving: Moving roots, none for a character that stands where it is.
    """

    frame_times: Array
    tracks: tuple[Track, ...]
    current: tuple[Track, ...]
    moving: tuple[MovingFrame, ...] = ()
