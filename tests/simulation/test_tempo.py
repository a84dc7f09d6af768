"""Least slowing against closed forms: one hinge under limits of speed, acceleration and effort."""

import numpy as np
import pytest
from calmotion.simulation import MotorEfforts, TempoLimits, needed_tempo

FREE = np.full(1, np.inf)


def limits(**given):
    return TempoLimits(**{name: np.full(1, given.get(name, np.inf)) for name in TempoLimits.__dataclass_fields__})


def move(turn=1.0, seconds=1.0, count=801):
    """A quintic from rest to rest."""
    times = np.linspace(0.0, seconds, count)
    s = times / seconds
    return times, turn * (s**3 * (10.0 - 15.0 * s + 6.0 * s * s))[:, None]


def test_what_keeps_all_limits_stays_as_it_is():
    times, values = move()
    found = needed_tempo(times, values, limits(velocity=2.0, acceleration=6.0, jerk=61.0), None)
    assert found.uniform == 1.0 and found.least_added_s == 0.0 and np.all(found.stretch == 1.0)


@pytest.mark.parametrize("share", [0.9, 0.6, 0.4])
def test_a_limit_of_speed_stretches_where_the_motion_is_faster(share):
    times, values = move()
    peak = 1.875
    found = needed_tempo(times, values, limits(velocity=share * peak), None)
    assert found.uniform == pytest.approx(1.0 / share, rel=1e-3)
    # where the curve is faster than the limit, the path is covered at the limit
    rate = 30.0 * times**2 * (1.0 - times) ** 2
    exact = np.trapezoid(np.maximum(rate / (share * peak) - 1.0, 0.0), times)
    assert found.least_added_s == pytest.approx(exact, rel=5e-3)
    assert np.all(found.stretch[[0, -1]] < 1.0 + 1e-9) and found.stretch.max() == pytest.approx(1.0 / share, rel=1e-3)
    assert found.uniform_added_s == pytest.approx(1.0 / share - 1.0, rel=1e-3)


@pytest.mark.parametrize("share", [0.5, 0.2])
def test_a_limit_of_acceleration_gives_bang_bang(share):
    """Far below what the curve needs, all of the path is the fastest: two phases at the limit, 2 sqrt(turn / a)."""
    times, values = move()
    largest = share * 5.7735
    found = needed_tempo(times, values, limits(acceleration=largest), None)
    assert found.uniform == pytest.approx(np.sqrt(1.0 / share), rel=1e-3)
    fastest = 2.0 * np.sqrt(1.0 / largest)
    assert fastest - 1.0 - 2e-2 <= found.least_added_s
    # as accelerations at the ends are zero in the animation, which is never made faster
    assert found.least_added_s <= found.uniform_added_s


def test_a_limit_of_effort_with_gravity_and_one_that_holds_no_pose():
    times, values = move()
    rate, acceleration = 30.0 * times**2 * (1 - times) ** 2, 60.0 * times * (1 - times) * (1 - 2 * times)
    inertia, weight = 0.4, 1.0
    efforts = MotorEfforts(np.full((801, 1), weight), inertia * acceleration[:, None], inertia * rate[:, None])
    peak = inertia * np.abs(acceleration).max()
    found = needed_tempo(times, values, limits(effort=weight + 0.5 * peak), efforts)
    assert found.uniform == pytest.approx(np.sqrt(2.0), rel=1e-3)
    assert 0.0 < found.least_added_s < found.uniform_added_s
    lame = needed_tempo(times, values, limits(effort=0.9 * weight), efforts)
    assert lame.uniform == np.inf and lame.least_added_s == np.inf
    assert lame.too_weak is not None and (lame.too_weak.motor, lame.too_weak.needed) == (0, pytest.approx(weight))
    # a pose that only haste would carry is not held either
    carried = MotorEfforts(np.full((801, 1), weight), np.full((801, 1), -0.5), np.zeros((801, 1)))
    assert needed_tempo(times, values, limits(effort=0.8 * weight), carried).too_weak is not None


def test_the_fastest_performance_keeps_the_limits_when_it_is_played():
    random, times = np.random.default_rng(3), np.linspace(0.0, 3.0, 1201)
    values = np.stack([np.sin(2.0 * np.pi * f * times + p) for f, p in random.uniform(0.3, 1.2, (3, 2))], axis=1)
    bound = TempoLimits(*(np.full(3, value) for value in (4.0, 25.0, np.inf, np.inf)))
    found = needed_tempo(times, values, bound, None)
    clock = np.concatenate([[0.0], np.cumsum(np.diff(found.times) * 0.5 * (found.stretch[1:] + found.stretch[:-1]))])
    dense = np.linspace(0.0, clock[-1], 20_000)
    s = np.interp(dense, clock, found.times)
    played = np.stack([np.interp(s, times, column) for column in values.T], axis=1)
    speed = np.gradient(played, dense, axis=0)
    # straight between the instants of the linear programme
    assert np.abs(speed).max() <= 4.0 * 1.05
    assert clock[-1] == pytest.approx(3.0 + found.least_added_s, rel=1e-3)
    assert found.least_added_s < 0.6 * found.uniform_added_s


def test_a_uniform_limit_of_jerk_is_a_cube_root():
    times, values = move()
    found = needed_tempo(times, values, limits(jerk=60.0 / 8.0), None)
    assert found.uniform == pytest.approx(2.0, rel=2e-2)
