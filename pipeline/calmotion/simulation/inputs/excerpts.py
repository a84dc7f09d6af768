"""Parts of a shot's animation in time, as animations of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Animation, FreeTrack
from calmotion.model.curves import held_curve

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
    free = tuple(FreeTrack(track.motor, track.times - start, track.free) for track in animation.free)
    moving = tuple(replace(frame, times=frame.times - start) for frame in animation.moving)
    return Animation(frame_times, tracks, tracks, moving, weights, free)


def busiest(animation: Animation, seconds: float) -> Animation:
    """The part of so many seconds around the largest accelerations of the motors, as they were animated; the animation
    itself where it is no longer."""
    times = animation.frame_times
    if len(times) < 2 or times[-1] <= seconds or not animation.tracks:
        return animation
    values = np.stack([held_curve(track, times[-1])(times, 2) for track in animation.tracks], axis=1)
    shares = values / np.maximum(np.abs(values).max(axis=0), 1e-12)  # a slide and a hinge count alike
    brief = max(1, round(_BRIEF / times[1]))
    means = np.convolve(np.sum(shares**2, axis=1), np.ones(brief), "same")
    count = round(seconds / times[1])
    first = int(np.clip(int(np.argmax(means)) - count // 2, 0, len(times) - 1 - count))
    return later(animation, float(times[first]), times[: count + 1])
