"""Which poses are baked."""

from __future__ import annotations

import numpy as np
from calmotion.model import Motion
from calmotion.usd.writing.bake import simulated_motion


def motion(times: np.ndarray) -> Motion:
    count = len(times)
    positions = np.zeros((count, 1, 3))
    positions[:, 0, 0] = times
    none = np.zeros((count, 0))
    return Motion(times, positions, np.tile([1.0, 0, 0, 0], (count, 1, 1)), (times[:, None],), none, none, none, none)


def test_frames_are_picked_out_of_the_steps_without_the_pre_roll():
    frames = np.arange(25) / 24.0
    found = simulated_motion(motion((np.arange(24 * 20 + 48 + 1) - 48) / 480.0), frames)
    assert np.array_equal(found.times, frames)
    assert np.allclose(found.positions[:, 0, 0], frames) and np.allclose(found.elastic[0][:, 0], frames)


def test_an_interrupted_run_gives_the_frames_it_reached():
    found = simulated_motion(motion(np.arange(100) / 480.0), np.arange(25) / 24.0)
    assert len(found.times) == 5
