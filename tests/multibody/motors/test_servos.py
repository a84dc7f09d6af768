"""The torque of a servo's motor: limits, their derivatives, and what is left of a torque within them."""

import numpy as np
import pytest
from calmotion.multibody.motors.servos import motor_effort

# gains, friction and its speed play no part
FREE = np.array([1.0, 1.0, 0.0, 1.0, np.inf, 0.0, 0.0])
FLAT = np.array([1.0, 1.0, 0.0, 1.0, 2.0, 0.0, 0.0])
FALLING = np.array([1.0, 1.0, 0.0, 1.0, 2.0, 1 / 50.0, 0.4])


def test_a_motor_without_limit_gives_what_is_wanted():
    assert motor_effort(FREE, 1e6, 30.0) == (1e6, 1.0, 0.0)


@pytest.mark.parametrize("speed", [0.0, 10.0, -10.0, 35.0, -35.0])
def test_torque_within_half_of_the_limits_is_what_is_wanted_and_never_exceeds_them(speed):
    falling = min(1.0, (1.0 - abs(speed) / 50.0) / 0.6)
    driving = 2.0 * falling  # at this speed; against the motion the largest torque is there
    upper, lower = (driving, -2.0) if speed >= 0.0 else (2.0, -driving)
    middle, half = 0.5 * (upper + lower), 0.5 * (upper - lower)
    for share in (-0.45, 0.0, 0.45):
        assert motor_effort(FALLING, middle + share * half, speed)[0] == pytest.approx(middle + share * half, abs=2e-3)
    for wanted in np.linspace(-9.0, 9.0, 37):
        assert lower - 1e-9 <= motor_effort(FALLING, wanted, speed)[0] <= upper + 1e-9
    assert motor_effort(FALLING, 1e3, speed)[0] == pytest.approx(upper, rel=0.06)
    assert motor_effort(FALLING, -1e3, speed)[0] == pytest.approx(lower, rel=0.06)


@pytest.mark.parametrize("motor", [FLAT, FALLING], ids=["flat", "falling"])
def test_derivatives_match_differences(motor):
    e = 1e-6
    for wanted in (-3.0, -1.9, 0.3, 1.2, 2.05):
        for speed in (-48.0, -21.0, 0.0, 4.0, 31.0):
            _, by_wanted, by_speed = motor_effort(motor, wanted, speed)
            ends = [motor_effort(motor, wanted + s * e, speed)[0] for s in (1, -1)]
            assert by_wanted == pytest.approx((ends[0] - ends[1]) / (2 * e), abs=1e-7)
            ends = [motor_effort(motor, wanted, speed + s * e)[0] for s in (1, -1)]
            assert by_speed == pytest.approx((ends[0] - ends[1]) / (2 * e), abs=1e-7)


def test_there_is_no_torque_left_at_the_no_load_speed():
    assert motor_effort(FALLING, 1e3, 50.0)[0] == pytest.approx(0.0, abs=1e-6)
    assert motor_effort(FALLING, -1e3, 50.0)[0] == pytest.approx(-2.0, rel=0.06)
