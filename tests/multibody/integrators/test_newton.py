"""Newton's method of a step: how far it converges, what it costs, its safeguard, and what it says when it fails."""

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators import newton
from calmotion.multibody.integrators.coefficients import bdf2_integrator
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.system import STVK, Instants, allocate_state
from particles import particle_system


def fallen(h, rate, predicted=None):
    """One step of a pendulum turning at a rate [rad/s], started from a guess of its turn; (result of `step`, state)."""
    model = compiled(chain(1))
    system, ws, zero = model.system, Workspace.for_system(model.system), np.zeros(1)
    states = []
    for angle in (-rate * h, 0.0):
        state = rigid_state(model, np.array([angle]))
        state.V[0, 4], state.turn[0, 1] = rate, rate * h
        states.append(state)
    now = allocate_state(system)
    if predicted is not None:
        guess = rigid_state(model, np.array([predicted]))
        now.c[:], now.q[:], now.turn[0, 1] = guess.c, guess.q, predicted
    instants = Instants(*states, now)
    result = newton.step(system, bdf2_integrator(h), instants, zero, zero, predicted is not None, ws)
    return result, now


def test_one_factorisation_serves_a_step_and_it_converges_to_rounding():
    (code, factorisations, residuals, _), now = fallen(1e-3, 3.0)
    assert code == newton.CONVERGED and factorisations == 1 and residuals <= 4
    (_, _, more, _), again = fallen(1e-3, 3.0, predicted=now.turn[0, 1])
    assert more <= 2 and np.abs(again.turn - now.turn).max() < 1e-14


@pytest.mark.parametrize("off", [0.5, 1.5, -2.0])
def test_a_distant_guess_converges_to_the_same_state(off):
    _, now = fallen(5e-3, 10.0)
    (code, *_), found = fallen(5e-3, 10.0, predicted=now.turn[0, 1] + off)
    assert code == newton.CONVERGED
    assert np.abs(found.turn - now.turn).max() < 1e-12 and np.abs(found.c - now.c).max() < 1e-12


def test_what_is_not_a_number_is_not_a_state():
    (code, _, _, component), _ = fallen(1e-3, np.nan)
    assert code != newton.CONVERGED and component == 0


def valley_run(stiffness, h, steps, rate=2.0):
    """A clamped body whose second coordinate is held to the square of the first by a stiff spring, as a patch that
    turns holds its shape, swings freely: (residuals, first coordinate at the end)."""
    system, _ = particle_system(np.random.default_rng(3), [-1], [2])
    strain = np.array([0.0, 1.0, -1.0, 0.0, 0.0])  # of (u0, u1, u0 u0, u0 u1, u1 u1)
    soft = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    gram = stiffness * np.outer(strain, strain) + 50.0 * np.outer(soft, soft)
    system = system._replace(
        law=np.array([STVK], dtype=np.int32), stvk=np.array([0], dtype=np.int32), stiffness=np.zeros((1, 2)),
        damping=np.zeros((1, 2, 2)), points=np.array([2]), data_start=np.zeros(1, dtype=np.int64), data=gram.ravel(),
        gravity=np.zeros(3), position=np.zeros((1, 2, 3)), rotation=np.tile(np.eye(3), (1, 2, 1, 1)),
        Phi=np.zeros((1, 2, 3, 2)), Psi=np.zeros((1, 2, 3, 2)),
    )  # fmt: skip
    ws, zero, states, residuals = Workspace.for_system(system), np.zeros(1), [], 0
    for time in (-h, 0.0):
        state = allocate_state(system)
        state.q[0, 0] = 1.0
        state.u[0, 0], state.V[0, 6] = rate * time, rate
        state.u[0, 1], state.V[0, 7] = state.u[0, 0] ** 2, 2.0 * state.u[0, 0] * rate
        states.append(state)
    for _ in range(steps):
        now = allocate_state(system)
        instants = Instants(*states[-2:], now)
        code, _, solved, _ = newton.step(system, bdf2_integrator(h), instants, zero, zero, False, ws)
        assert code == newton.CONVERGED
        residuals += solved
        states.append(now)
    return residuals, states[-1].u[0, 0]


@pytest.mark.parametrize("h", [0.01, 0.02])
def test_stiff_springs_that_follow_a_turn_do_not_lead_astray(h):
    """Corrections that are halved end at no state here (stiffness 1e10, 10 ms; 1e8, 20 ms)."""
    steps = round(1.0 / h)
    ends = []
    for stiffness in (1e6, 1e8, 1e10):
        residuals, end = valley_run(stiffness, h, steps)
        assert residuals < 8 * steps
        ends.append(end)
    assert ends[2] == pytest.approx(ends[1], rel=1e-3) and ends[1] == pytest.approx(ends[0], rel=1e-2)
