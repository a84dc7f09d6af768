"""Starting in motion: consistent accelerations, and the order of the scheme from the first step on."""

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_state, target_frames
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.statics.consistent_start import initial_acceleration, instant_before
from scipy.integrate import solve_ivp

SPIN, LENGTH, GRAVITY = 2.0, 1.0, 9.81


def released():
    """A pendulum of a point mass, level, turning about y at `SPIN`; positive angles go down."""
    model = compiled(chain(1))
    state = rigid_state(model, np.zeros(1))
    state.V[0, 4] = SPIN
    return model, state


def test_the_acceleration_is_that_of_a_pendulum():
    model, state = released()
    zero = np.zeros(1)
    found, lam = initial_acceleration(model.system, state, zero, zero, zero, Workspace.for_system(model.system))
    assert found[0, 4] == pytest.approx(GRAVITY / LENGTH, rel=1e-6)
    assert np.abs(found[0, :3]).max() < 1e-9  # the hinge stays
    # at the hinge: the pull of the turn alone, the weight of a point mass falls freely
    assert lam[0, :3] == pytest.approx([-(SPIN**2) * LENGTH, 0.0, 0.0], abs=1e-5)


def test_the_instant_before_is_continued_to_second_order():
    model, state = released()
    zero = np.zeros(1)
    acceleration, _ = initial_acceleration(model.system, state, zero, zero, zero, Workspace.for_system(model.system))
    turns = []
    for h in (0.02, 0.01):
        before, turn = instant_before(model.system, state, acceleration, h)
        turns.append(abs(turn[0, 1] - _turned(h)))
        assert np.linalg.norm(before.q[0]) == pytest.approx(1.0)
    assert turns[1] < turns[0] / 7.0


def _turned(h):
    """How far the pendulum turned in the time h before the start."""
    past = solve_ivp(lambda t, y: [y[1], GRAVITY * np.cos(y[0])], (0.0, -h), [0.0, SPIN], rtol=1e-11, atol=1e-13)
    return -past.y[0, -1]


def test_from_a_start_in_motion_it_is_of_second_order():
    errors = []
    exact = solve_ivp(lambda t, y: [y[1], GRAVITY * np.cos(y[0])], (0.0, 0.4), [0.0, SPIN], rtol=1e-11, atol=1e-13)
    angle = exact.y[0, -1]
    for steps in (40, 80, 160):
        model, state = released()
        still = np.zeros((steps + 1, 1))
        run = simulate(
            model.system, state, still, still, 0.4 / steps, Workspace.for_system(model.system), from_equilibrium=False
        )
        tip = target_frames(model, run.states.c, run.states.q, run.states.u)[0][-1, 0]
        errors.append(np.linalg.norm(tip - [np.cos(angle), 0.0, -np.sin(angle)]))
    assert errors[0] > 3.6 * errors[1] > 3.6**2 * errors[2]
