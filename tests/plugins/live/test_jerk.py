"""Motions whose accelerations may change by so much only."""

import numpy as np
import pytest
from calmotion_plugins.live import Stream
from calmotion_plugins.live.regulation.limits import MotorLimits

TICK = 1.0 / 250.0


def limits(fastest, hardest, jerk):
    """Of two motors, the second of which may jerk."""
    positions = (np.array([-2.0, -1.0]), np.array([2.0, 1.5]))
    return MotorLimits(*positions, np.full(2, fastest), np.full(2, hardest), np.array([jerk, np.inf]), TICK)


def followed(samples, **own):
    """Positions at the ticks of a stream, shape [T, 2]."""
    stream = Stream(limits(**own), 0.1, TICK)
    stream.begin(np.zeros(2))
    found = []
    for k, sample in enumerate(samples):
        stream.give(k * TICK, sample)
        found.append(stream.advance().copy())
    return np.array(found)


@pytest.mark.parametrize(
    ("fastest", "hardest", "jerk"),
    [(3.0, 60.0, 2000.0), (1.0, 10.0, 100.0), (3.0, 60.0, 3e4), (3.0, np.inf, 500.0), (np.inf, 20.0, 400.0)],
)
def test_no_limit_is_exceeded_and_rest_is_rest(fastest, hardest, jerk):
    """Walks at random with jumps of a radian, partly beyond the limits of positions, and then rest."""
    random, steps = np.random.default_rng(1), np.zeros((4000, 2))
    steps[:3000] = 0.02 * random.normal(size=(3000, 2)) + (random.random((3000, 1)) < 5e-3) * random.normal(
        size=(3000, 2)
    )
    samples, own = np.clip(np.cumsum(steps, axis=0), -3.0, 3.0), limits(fastest, hardest, jerk)
    found = followed(samples, fastest=fastest, hardest=hardest, jerk=jerk)
    before = np.zeros((3, 2))
    speeds = np.diff(np.concatenate([before, found]), axis=0) / TICK
    changes = np.diff(speeds, axis=0) / TICK
    assert np.all(found <= own.upper + 1e-9) and np.all(found >= own.lower - 1e-9)
    assert np.abs(speeds).max() <= fastest + 1e-9 and np.abs(changes).max() <= hardest + 1e-6
    assert np.abs(np.diff(changes[:, 0])).max() / TICK <= jerk * (1.0 + 1e-5)
    np.testing.assert_allclose(found[-1], np.clip(samples[-1], own.lower, own.upper), atol=1e-12)


@pytest.mark.parametrize("way", [0.02, 0.1, 1.0])
def test_a_jump_takes_as_long_as_the_fastest_motion(way):
    """With seven pieces of constant jerk: way over speed, speed over acceleration, acceleration over jerk."""
    fastest, hardest, jerk = 3.0, 60.0, 2000.0
    if way >= fastest**2 / hardest + fastest * hardest / jerk:
        least = way / fastest + fastest / hardest + hardest / jerk
    elif way >= 2.0 * hardest**3 / jerk**2:
        least = hardest / jerk + np.sqrt((hardest / jerk) ** 2 + 4.0 * way / hardest)
    else:
        least = 4.0 * np.cbrt(way / (2.0 * jerk))
    found = followed(np.full((400, 2), way), fastest=fastest, hardest=hardest, jerk=jerk)
    arrived = TICK * (1 + np.flatnonzero(np.abs(found[:, 0] - way) > 1e-9).max(initial=-1) + 1)
    assert found[:, 0].max() <= way + 1e-9
    assert least - 2.0 * TICK <= arrived <= least + 5.0 * TICK, (arrived, least)


def test_a_motion_within_the_limits_is_followed_at_once():
    times = TICK * np.arange(1000)
    samples = np.stack([0.5 * np.sin(4.0 * times) ** 3, 0.3 * np.sin(7.0 * times) ** 3], axis=1)
    found = followed(samples, fastest=4.0, hardest=60.0, jerk=4000.0)
    np.testing.assert_allclose(found, samples, atol=1e-12)
