"""Players of commands against other programs' interpolation, and against what they must hold."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.control.commands import CUBIC, HOLD, LINEAR, QUINTIC, SETTLED, Commands
from calmotion.control.players import played
from scipy.interpolate import BPoly, CubicHermiteSpline

TIMES = np.array([0.0, 0.1, 0.2, 0.35])
RNG = np.random.default_rng(3)
P, V, A = (RNG.normal(size=(4, 2)) for _ in range(3))
BETWEEN = np.linspace(0.0, 0.3499, 57)


def test_lines_are_those_of_numpy():
    curve = played(Commands(LINEAR, TIMES, P))
    expected = np.stack([np.interp(BETWEEN, TIMES, column) for column in P.T], axis=1)
    np.testing.assert_allclose(curve(BETWEEN, 0), expected, atol=1e-14)
    np.testing.assert_allclose(curve(np.array([0.05]), 1), np.diff(P[:2], axis=0) / 0.1, atol=1e-12)


@pytest.mark.parametrize("order", [0, 1])
def test_cubics_and_quintics_are_those_of_scipy(order):
    cubic = CubicHermiteSpline(TIMES, P, V)
    np.testing.assert_allclose(played(Commands(CUBIC, TIMES, P, V))(BETWEEN, order), cubic(BETWEEN, order), rtol=1e-10)
    quintic = BPoly.from_derivatives(TIMES, np.stack([P, V, A], axis=1))
    found = played(Commands(QUINTIC, TIMES, P, V, A))(BETWEEN, order)
    np.testing.assert_allclose(found, quintic(BETWEEN, nu=order), rtol=1e-9, atol=1e-9)


def test_a_held_command_is_reached_at_constant_speed_and_kept():
    times, start = np.array([0.0, 0.1, 0.2]), np.array([1.0])
    curve = played(Commands(HOLD, times, np.array([[2.0], [4.0], [3.0]]), start=start))
    at = np.array([-0.1, 0.0, 0.5 * SETTLED, SETTLED, 0.09, 0.1, 0.1 + 0.25 * SETTLED, 0.15, 0.3])
    np.testing.assert_allclose(curve(at, 0)[:, 0], [1.0, 1.0, 1.5, 2.0, 2.0, 2.0, 2.5, 4.0, 3.0])


def test_commands_faster_than_a_motor_settles_are_lines_that_come_a_period_later():
    times = np.arange(5) * 0.5 * SETTLED
    values = RNG.normal(size=(5, 1))
    curve, lines = played(Commands(HOLD, times, values)), played(Commands(LINEAR, times, values))
    at = np.linspace(0.0, times[-1], 31)
    np.testing.assert_allclose(curve(at + 0.5 * SETTLED, 0), lines(at, 0), atol=1e-12)


def test_after_the_last_command_the_motor_rests_and_a_loop_begins_again():
    values = np.array([[0.0], [1.0], [2.0 * np.pi]])
    once, loop = (played(Commands(LINEAR, np.array([0.0, 0.1, 0.2]), values), cyclic) for cyclic in (False, True))
    assert once(np.array([0.5]), 0)[0, 0] == 2.0 * np.pi and once(np.array([0.5]), 1)[0, 0] == 0.0
    assert loop(np.array([0.25]), 0)[0, 0] == pytest.approx(0.5 + 2.0 * np.pi), "whole turns add up"
    assert loop(np.array([-0.15]), 0)[0, 0] == pytest.approx(0.5 - 2.0 * np.pi)
