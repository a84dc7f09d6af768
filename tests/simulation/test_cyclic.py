"""Loops that get up to speed, and roots that do not come back."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model import MovingFrame
from calmotion.multibody.model.moving_markers import pack
from calmotion.simulation.cyclic import eased, refuse_open_loops
from scipy.spatial.transform import Rotation

STEPS, H = 300, 0.01
TIMES = H * (np.arange(STEPS + 2) - 1)
RATE = 2.0 * np.pi / (STEPS * H)


def test_a_first_cycle_from_rest_reaches_the_cyclic_motion():
    angles = np.stack([np.sin(RATE * TIMES), RATE * TIMES], axis=1)  # the second one turns round and round
    rates = np.stack([RATE * np.cos(RATE * TIMES), np.full_like(TIMES, RATE)], axis=1)
    turning = Rotation.from_rotvec(np.outer(0.5 * np.sin(RATE * TIMES), [0.0, 0.6, 0.8]))
    spin = np.outer(0.5 * RATE * np.cos(RATE * TIMES), [0.0, 0.6, 0.8])
    world = pack(
        np.outer(np.sin(RATE * TIMES), [1.0, 0.0, 0.0]), rates[:, :1] * [1.0, 0.0, 0.0], spin, turning.as_matrix()
    )
    moved, speeds, roots = eased(angles, rates, world[:, None], H)
    assert np.abs(speeds[0]).max() == 0.0 and np.abs(roots[0, 0, 3:9]).max() == 0.0
    assert np.abs((moved[2:] - moved[:-2]) / (2.0 * H) - speeds[1:-1]).max() < 2e-3 * RATE
    velocity = (roots[2:, 0, :3] - roots[:-2, 0, :3]) / (2.0 * H)
    assert np.abs(velocity - roots[1:-1, 0, 3:6]).max() < 2e-3 * RATE
    # the last loop is the loop itself
    assert np.abs(moved[-STEPS - 1 :] - angles[1:] - [0.0, 0.0]).max() < 1e-6
    assert np.abs(roots[-STEPS - 1 :, 0] - world[1:]).max() < 1e-6


def test_a_root_that_is_elsewhere_at_the_end_is_refused(arm, animation):
    times = animation.frame_times
    still = dataclasses.replace(animation, tracks=(), current=())
    character = dataclasses.replace(arm, motors=())
    turned = Rotation.from_rotvec(np.outer(times, [0.0, 0.0, 0.1])).as_quat()
    for positions, rotations, shown in (
        (np.outer(times, [0.2, 0.0, 0.0]), np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1)), "300 mm"),
        (np.zeros((len(times), 3)), np.roll(turned, 1, axis=1), "8.59 degrees"),
    ):
        root = MovingFrame(0, times, positions, rotations)
        with pytest.raises(ShotError, match="first and the last frame of this root") as error:
            refuse_open_loops(character, dataclasses.replace(still, moving=(root,)))
        assert error.value.path == arm.joints[0].path and shown in str(error.value.found) and error.value.remedy
