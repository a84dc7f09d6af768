"""A long performance of the small arm: moves of different lengths and sizes, with short rests."""

import numpy as np
from arm_fixtures import ease
from calmotion.model import Animation, Track


def long_moves(seconds, rate=24.0, seed=1):
    """Random moves of both motors, the same for the same seed; a longer one begins as a shorter one does."""
    times = np.arange(round(seconds * rate) + 1) / rate
    return animation_of(times, [_moves(times, np.random.default_rng([seed, motor])) for motor in range(2)])


def animation_of(times, values):
    tracks = tuple(Track(times, column) for column in values)
    return Animation(times, tracks, tracks)


def _moves(times, random):
    values, start, angle = np.zeros_like(times), 0.3, 0.0
    while start < times[-1] - 0.8:
        length, following = random.uniform(0.35, 0.6), random.uniform(-0.8, 0.8)
        values += (following - angle) * ease(times, start, length)
        angle, start = following, start + length + random.uniform(0.1, 0.6)
    return values
