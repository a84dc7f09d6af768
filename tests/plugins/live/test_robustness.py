"""How much robots of other frequencies count unless one says so."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.simulation import impulses
from calmotion_plugins.live import gains_at
from calmotion_plugins.live.regulation.robustness import EQUAL, PERIODS, SLACK, Moves, affordable_others
from hinges import TICK, hinge, two_hinges, weighting, with_free_motion

UNCERTAINTY = 0.1


def makes(pose, window, **changes):
    """Gains for a share of other robots."""
    alone = weighting(window, pose.by_acceleration.shape[1], **changes)
    return lambda share: gains_at(pose, np.eye(pose.by_acceleration.shape[1]), alone.with_others(UNCERTAINTY, share))


def test_others_count_until_the_robot_of_the_model_would_lose():
    make = makes(two_hinges(), 40)
    share = affordable_others(make, np.eye(2), TICK)
    test = Moves(make(0.0), np.eye(2), TICK)
    assert 1e-3 < share < EQUAL
    assert test.left_by(make(share)) <= SLACK * test.left_by_shaper < test.left_by(make(1.2 * share))


def test_others_do_not_count_where_motors_cannot_do_what_the_targets_need():
    """The tip swings across the way in which the motor moves it."""
    pose, across = hinge(), np.zeros((1, 6, 1))
    across[0, 1] = 1.0
    assert affordable_others(makes(replace(pose, targets_by_mode=across), 40), np.eye(1), TICK) == 0.0
    assert affordable_others(makes(pose, 60), np.eye(1), TICK) > 0.0


def test_a_free_motion_of_the_robot_sets_no_period():
    """As the spin of a ball joint, which is the mode of the lowest frequency."""
    pose = two_hinges()
    left = [Moves(makes(p, 40)(0.0), np.eye(2), TICK).left_by_shaper for p in (pose, with_free_motion(pose))]
    assert left[1] == pytest.approx(left[0], rel=1e-9)


def test_a_shaper_leaves_what_its_commands_do():
    """The hinge on its own, tick by tick."""
    make = makes(hinge(), 40)
    gains, seconds = make(0.3), PERIODS / 3.0
    times = TICK * np.arange(round(3.0 / TICK))

    def way(late):
        s = np.clip((times - late) / seconds, 0.0, 1.0)
        return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)

    parts = zip(*impulses("zv", np.array([3.0]), np.array([0.01])), strict=True)
    shaped = sum(share * way(0.4 + late) for late, share in parts)
    robot, x, place = make(0.0), np.zeros(4), []
    for k, change in enumerate(np.diff(shaped, 2, prepend=shaped[0], append=shaped[-1]) / TICK):
        place.append(shaped[k] + x[2])
        x = robot.transition @ x + robot.by_change[:, 0] * change
    until = round((0.4 + seconds + 2.0 / 3.0) / TICK)
    errors = [np.linalg.norm((place - way(0.4 + TICK * k))[:until]) for k in range(160)]
    assert Moves(gains, np.eye(1), TICK).left_by_shaper == pytest.approx(min(errors), rel=0.02)
