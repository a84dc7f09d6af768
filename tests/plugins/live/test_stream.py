"""Samples as they arrive, and limits of commands that run straight between ticks."""

import numpy as np
import pytest
from calmotion_plugins.live import Stream
from calmotion_plugins.live.regulation.limits import MotorLimits

TICK = 0.004


def limits(count=1, lower=-2.0, upper=2.0, velocity=3.0, acceleration=40.0, jerk=np.inf):
    return MotorLimits(*(np.full(count, value) for value in (lower, upper, velocity, acceleration, jerk)), TICK)


def begun(patience=0.1, period=0.0, **changes):
    stream = Stream(limits(**changes), patience, period)
    stream.begin(np.zeros(1))
    return stream


def smooth(t):
    return 0.8 * (1.0 - np.cos(2.0 * t))


def assert_within(found, bounds, rounding=1e-9):
    speed = np.diff(found, axis=0, prepend=found[:1]) / TICK
    change = np.diff(speed, axis=0, prepend=speed[:1]) / TICK
    assert np.all(found <= bounds.upper + rounding) and np.all(found >= bounds.lower - rounding)
    assert np.all(np.abs(speed) <= bounds.velocity * (1.0 + rounding) + 1e-9)
    assert np.all(np.abs(change) <= bounds.acceleration * (1.0 + 1e-6) + 1e-5)


def test_samples_in_time_pass_unchanged():
    stream, times = begun(), TICK * np.arange(500)
    for t in times:
        stream.give(t, np.array([smooth(t)]))
        np.testing.assert_allclose(stream.advance(), smooth(t), atol=1e-12)
    assert not stream.events


@pytest.mark.parametrize("rate, rounding", [(50.0, 2e-4), (100.0, 2e-5)])
def test_a_slower_sender_is_played_smoothly_two_samples_later(rate, rounding):
    period = 1.0 / rate
    stream, found, sent = begun(period=period), [], 0
    for k in range(1000):
        while sent * period <= k * TICK + 1e-9:
            stream.give(sent * period, np.array([smooth(sent * period)]))
            sent += 1
        found.append(stream.advance()[0])
    times = TICK * np.arange(1000) - stream.delay
    assert stream.delay == 2.0 * period
    late = times > 0.2
    np.testing.assert_allclose(np.array(found)[late], smooth(times[late]), atol=rounding)
    assert np.abs(np.diff(found, 2)).max() / TICK**2 < 2.5 * 0.8 * 4.0


def test_a_sender_that_dies_is_followed_for_the_patience_and_rests_at_its_last_sample():
    stream, found = begun(patience=0.1), []
    for k in range(400):
        if k < 200:
            stream.give(k * TICK, np.array([k * TICK]))
        found.append(stream.advance()[0])
    assert stream.events["late"] == 200
    last = 199 * TICK
    assert found[203] == pytest.approx(203 * TICK, abs=5e-3), "a few samples that are lost are bridged"
    assert max(found) < last + 0.1 and np.abs(np.array(found[260:]) - last).max() < 1e-9


def test_samples_that_arrive_before_their_time_wait_for_it():
    """Chunks of half a second, each of which takes the place of the rest of the one before; a file through a pipe."""
    stream, found = begun(), []
    for k in range(1000):
        if k % 75 == 0:
            for ahead in range(k, k + 125):
                stream.give(ahead * TICK, np.array([smooth(ahead * TICK)]))
        found.append(stream.advance()[0])
    np.testing.assert_allclose(found, smooth(TICK * np.arange(1000)), atol=1e-9)
    assert set(stream.events) == {"replaced"}
    assert stream.ahead_s == pytest.approx(99 * TICK) and stream.sender_rate == pytest.approx(250.0)


def test_faults_of_a_stream_are_counted_and_do_not_move_the_robot():
    stream = begun()
    for stamp, value in ((0.0, 0.0), (0.004, 0.0), (0.004, 0.5), (0.001, 0.5), (0.008, np.nan), (np.inf, 0.5)):
        used = stream.give(stamp, np.array([value]))
        assert used == (value == 0.0)
        stream.advance()
    assert stream.position[0] == 0.0
    events = stream.events
    assert (events["repeated"], events["disordered"], events["not finite"]) == (1, 1, 2)
    stream.give(0.1, np.array([9.0]))
    assert stream.events["beyond a limit"] == 1


def test_a_clock_that_begins_anew_is_followed():
    stream = begun()
    for k in range(100):
        stream.give(1e6 + k * TICK, np.array([0.0]))
        stream.advance()
    for k in range(200):
        stream.give(k * TICK, np.array([0.3]))
        stream.advance()
    assert stream.events["restarted"] == 1
    np.testing.assert_allclose(stream.position, 0.3)


@pytest.mark.parametrize("drift", [-4e-4, 4e-4])
def test_a_clock_that_drifts_is_followed(drift):
    """A minute, in which the clocks part by six ticks."""
    stream, found = begun(), []
    for k in range(15_000):
        stamp = k * TICK * (1.0 + drift)
        stream.give(stamp, np.array([smooth(stamp)]))
        found.append(stream.advance()[0] - smooth(stamp))
    assert np.abs(found).max() < 5e-3
    assert stream.events["late"] < 100


def test_a_jump_becomes_the_fastest_motion_within_the_limits():
    stream, bounds, found = begun(), limits(), []
    for k in range(400):
        stream.give(k * TICK, np.array([0.0 if k < 50 else 1.0]))
        found.append(stream.advance().copy())
    assert_within(np.array(found), bounds)
    # up and down with 40 rad/s^2 to 3 rad/s: 1 / 3 + 3 / 40 s
    arrived = np.argmax(np.array(found)[:, 0] >= 1.0 - 1e-9)
    assert (arrived - 50) * TICK == pytest.approx(1.0 / 3.0 + 3.0 / 40.0, abs=3.0 * TICK)
    assert stream.events["jump"] == 1 and found[-1][0] == 1.0


def test_an_hour_of_hostile_samples_keeps_the_limits():
    """Thinned: each tick is drawn as in an hour, a tenth missing or late, jumps of a radian, values that are none."""
    random, stream, bounds, found = np.random.default_rng(7), begun(), limits(), []
    value = 0.0
    for k in range(15_000):
        kind = random.random()
        value += 0.01 * random.normal() + (random.choice([-1.0, 1.0]) if random.random() < 2e-3 else 0.0)
        value = float(np.clip(value, -4.0, 4.0))
        if kind > 0.1:
            stamp = k * TICK + 0.3 * TICK * random.normal() - (3.0 * TICK if kind < 0.15 else 0.0)
            stream.give(stamp, np.array([np.nan if kind > 0.99 else value]))
        found.append(stream.advance().copy())
    assert_within(np.array(found), bounds)
    for k in range(15_000, 16_000):
        stream.give(k * TICK, np.array([0.7]))
        stream.advance()
    assert stream.position[0] == pytest.approx(0.7, abs=1e-9)
