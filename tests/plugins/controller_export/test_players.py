"""Players of commands against other programs' interpolation, and against what they must hold."""

import numpy as np
import pytest
from calmotion_plugins.controller_export.commands import HOLD, LINEAR, SETTLED, Commands
from calmotion_plugins.controller_export.players import played

TIMES = np.array([0.0, 0.1, 0.2, 0.35])
RNG = np.random.default_rng(3)
P, V, A = (RNG.normal(size=(4, 2)) for _ in range(3))
BETWEEN = np.linspace(0.0, 0.3499, 57)


def test_commands_faster_than_a_motor_settles_are_lines_that_come_a_period_later():
    times = np.arange(5) * 0.5 * SETTLED
    values = RNG.normal(size=(5, 1))
    curve, lines = played(Commands(HOLD, times, values)), played(Commands(LINEAR, times, values))
    at = np.linspace(0.0, times[-1], 31)
    np.testing.assert_allclose(curve(at + 0.5 * SETTLED, 0), lines(at, 0), atol=1e-12)


def test_after_the_last_command_the_motor_rests_and_a_loop_begins_again():
    values = np.array([[1.0], [2.0], [1.0 + 2.0 * np.pi]])
    once, loop = (played(Commands(LINEAR, np.array([0.0, 0.1, 0.2]), values), cyclic) for cyclic in (False, True))
    assert once(np.array([0.5]), 0)[0, 0] == 1.0 + 2.0 * np.pi and once(np.array([0.5]), 1)[0, 0] == 0.0
    assert loop(np.array([0.25]), 0)[0, 0] == pytest.approx(1.5 + 2.0 * np.pi), "whole turns add up"
    assert loop(np.array([-0.15]), 0)[0, 0] == pytest.approx(1.5 - 2.0 * np.pi)
