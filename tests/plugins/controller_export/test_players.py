"""Players of commands against other programs' interpolation, and against what they must hold."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion_plugins.controller_export.commands import (
    BEZIER,
    FOLLOW,
    HOLD,
    LINEAR,
    SETTLED,
    Commands,
    Follower,
)
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


def test_other_bezier_curves_are_those_of_their_parameter():
    handles = np.array([[[0.02, 1.0, -0.07, 0.5]], [[0.06, -1.0, -0.01, 0.2]], [[0.05, 0.0, -0.13, 0.0]]])
    curve = played(Commands(BEZIER, TIMES, P[:, :1], handles=handles))
    for n in range(3):
        u = np.linspace(0.02, 0.98, 23)
        ends = np.array([[TIMES[n], P[n, 0]], [TIMES[n + 1], P[n + 1, 0]]])
        p = [ends[0], ends[0] + handles[n, 0, :2], ends[1] + handles[n, 0, 2:], ends[1]]
        weights = [(1 - u) ** 3, 3 * (1 - u) ** 2 * u, 3 * (1 - u) * u**2, u**3]
        t, value = sum(w[:, None] * point for w, point in zip(weights, p, strict=True)).T
        np.testing.assert_allclose(curve(t, 0)[:, 0], value, atol=2e-3)


def test_a_motor_follows_held_commands_by_its_law():
    times, start = np.arange(6) * 0.02, np.zeros(1)
    positions = np.array([[0.0], [0.1], [0.3], [0.4], [0.4], [0.35]])
    law = Follower(gain=900.0, lookahead=0.05)
    curve = played(Commands(FOLLOW, times, positions, start=start, follower=law))
    from scipy.integrate import solve_ivp

    def acceleration(t, state):
        command = positions[min(int(t / 0.02 + 1e-9), 5), 0]
        return [state[1], law.gain * (command - state[0] - law.lookahead * state[1])]

    exact = solve_ivp(acceleration, (0.0, 0.12), [0.0, 0.0], max_step=5e-4, rtol=1e-8, atol=1e-10, dense_output=True)
    at = np.linspace(0.0, 0.12, 41)
    np.testing.assert_allclose(curve(at, 0)[:, 0], exact.sol(at)[0], atol=1e-5)
    np.testing.assert_allclose(curve(at, 1)[:, 0], exact.sol(at)[1], atol=1e-3)


def test_control_points_at_the_ends_do_no_harm():
    handles = np.broadcast_to([0.0, 0.001, 0.0, -0.001], (3, 1, 4))
    curve = played(Commands(BEZIER, TIMES, P[:, :1], handles=handles))
    lines = np.interp(BETWEEN, TIMES, P[:, 0])
    np.testing.assert_allclose(curve(BETWEEN, 0)[:, 0], lines, atol=0.01)
