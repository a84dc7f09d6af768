"""Streams as bad as they come, on the samples: no limit is exceeded, nothing raises, and rest is rest."""

import numpy as np
import pytest
from calmotion.model import RunSettings
from calmotion.simulation import modes_of, prepare
from calmotion.workflow import Shot
from calmotion_plugins.live import Live, LiveSettings
from calmotion_plugins.live.opening import compiled
from calmotion_plugins.live.regulation.guard import Guard

RATE = 250.0
LONG = (("lamp", 3600.0, 5), ("bartender", 3600.0, 5))


def hostile(start, ticks, seed):
    """Stamps [s] and samples of motors, shape [M]: a tenth missing, late ones, jumps of a radian, NaN; then rest."""
    random, value = np.random.default_rng(seed), start.copy()
    for k in range(ticks):
        value = (
            value + 0.02 * random.normal(size=len(start)) + (random.random() < 5e-3) * random.normal(size=len(start))
        )
        value = np.clip(value, start - 1.5, start + 1.5)
        chance, late = random.random(), random.normal()
        sample = np.where(random.random(len(start)) < 0.01, np.nan, value)
        yield k / RATE + (1e-3 * late if chance < 0.95 else -0.02), None if chance < 0.1 else sample
    for k in range(ticks, ticks + round(8.0 * RATE)):
        yield k / RATE, value


@pytest.mark.parametrize(
    ("name", "seconds", "seed"),
    [("lamp", 2.0, 5), ("bartender", 2.0, 9), *(pytest.param(*case, marks=pytest.mark.long) for case in LONG)],
)
def test_commands_keep_their_limits_and_come_to_rest(repository, name, seconds, seed):
    """The bartender of that seed still swings by the model when deviations are gone, and must not deviate again."""
    shot = compiled(Shot(repository / "samples" / name / f"{name}.usda"))
    motors, joints = shot.character.motors, shot.character.joints
    lower, upper = (np.array([getattr(joints[m.joint], side) for m in motors]) for side in ("lower", "upper"))
    fastest, hardest = (np.array([getattr(m, side) for m in motors]) for side in ("max_velocity", "max_acceleration"))
    lookahead = 0.4 / modes_of(prepare(shot, RunSettings()))[0][0]
    with Live(shot, LiveSettings(RATE, lookahead, background=False)) as live:
        before, speed, beyond = live.start, np.zeros(len(motors)), np.full(3, -np.inf)
        for stamp, sample in hostile(live.start, round(seconds * RATE), seed):
            commands = live.step(stamp, sample)
            now = (commands - before) * RATE
            parts = (np.maximum(commands - upper, lower - commands), np.abs(now) - fastest)
            parts = (*parts, np.abs(now - speed) * RATE - (1.0 + 1e-6) * hardest)
            beyond = np.maximum(beyond, [part.max() for part in parts])
            before, speed = commands, now
        report = live.report()
    assert np.all(beyond <= 1e-9), beyond
    np.testing.assert_allclose(commands, np.clip(sample, lower, upper), atol=1e-9)
    assert report["events"]["late"] and report["events"]["not finite"] and report["limited"]


class Loop:
    """A regulator of one motor and one mode at 5 Hz whose target errs by its first state."""

    robots, targets, by_change = 1, np.eye(1, 4), np.zeros((4, 1))
    transition, by_impulse = np.diag([1.0, 1.0, 0.99, 0.99]), np.ones((4, 1))


def test_deviations_that_err_more_than_what_passes_through_are_let_go():
    guard, x, tick = Guard(1.0 / RATE), np.array([0.2, 0.0, 0.0, 0.0]), 1.0 / RATE
    guard.begin(4)
    for _ in range(round(4.0 * RATE)):
        guard.judge(Loop, x, np.zeros(1), True)
        if guard.lets_go:
            x[1] += guard.glide(x[:1], x[1:2])[0]
            x[0] += tick * x[1]
    assert abs(x[0]) < 1e-9 and guard.count > 100
    still = Guard(tick)
    still.begin(4)
    for _ in range(round(4.0 * RATE)):
        still.judge(Loop, np.array([1e-4, 0.0, 0.0, 0.0]), np.zeros(1), True)
    assert still.count == 0, "less than commands move ahead"
