"""Newton's method of a step: how far it converges, what it costs, its safeguard, and what it says when it fails."""

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators import newton
from calmotion.multibody.integrators.coefficients import bdf2_integrator
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.system import Instants, allocate_state


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


def test_worst_component_is_the_first_that_is_not_a_number():
    model = compiled(chain(3))
    x = np.zeros((3, model.system.size))
    x[2, 1] = 5.0
    assert newton.worst_component(model.system, x) == 2
    x[1, 3] = np.nan
    assert newton.worst_component(model.system, x) == 1
    assert np.isnan(newton.largest_entry(model.system, x))
