"""Commands that are sampled so that their player is on time."""

import numpy as np
import pytest
from calmotion.testing import small_shot
from calmotion_plugins.controller_export.commands import Follower, MotorCurves
from calmotion_plugins.controller_export.players import played
from calmotion_plugins.controller_export.sampling import bezier_commands, followed_commands, held_commands


@pytest.fixture
def ramp():
    """Curves that go at constant speed after a soft start of half a second."""
    character, _ = small_shot()

    def sample(times, order):
        t = np.minimum(times, 0.5)
        soft = [0.5 * t**2 / 0.5 + np.maximum(times - 0.5, 0.0), t / 0.5, np.where(times < 0.5, 2.0, 0.0)][order]
        return np.stack([soft, -2.0 * soft], axis=1)

    return MotorCurves("a", 2.0, False, character.motors, ("a", "b"), np.zeros((2, 2)), sample)


def test_a_motor_that_follows_is_on_time_at_constant_speed(ramp):
    commands = followed_commands(ramp, 125.0, 0.002, Follower(2000.0, 0.05))
    at = np.linspace(1.0, 1.9, 40)
    # what is left is the ripple of the held commands
    np.testing.assert_allclose(played(commands)(at, 0), ramp.at(at), atol=2e-4)
    assert commands.times[-1] == pytest.approx(2.0 + 8 * 0.05, abs=0.01)
    np.testing.assert_allclose(played(commands)(commands.times[-1:], 0), ramp.at(np.array([2.0])), atol=1e-3)


def test_a_motor_that_holds_is_on_time_at_constant_speed(ramp):
    at = np.linspace(1.0, 1.9, 400)
    off = played(held_commands(ramp, 50.0))(at, 0) - ramp.at(at)
    assert abs(off.mean()) < 2e-4 and np.abs(off[:, 0]).max() < 0.6 / 50.0


def test_keyframes_touch_the_curves(ramp):
    commands = bezier_commands(ramp, 4.0)
    at = np.linspace(0.0, 2.0, 101)
    np.testing.assert_allclose(played(commands)(at, 0), ramp.at(at), atol=1e-9)
