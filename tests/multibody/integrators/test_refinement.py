"""Steps that only smaller ones reach."""

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators import newton, refinement, simulation
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.sensitivity.linearization import linearize


def driven(model, turn, h=1.0 / 24.0, steps=12, divides=True):
    """A two-link arm whose first motor jumps by a turn [rad] from one instant to the next, while the other moves on."""
    angles, rates = np.zeros((steps, 2)), np.zeros((steps, 2))
    angles[steps // 2 :, 0] = turn
    angles[:, 1], rates[:, 1] = 0.3 * np.linspace(0.0, 1.0, steps) ** 2, 0.6 * np.linspace(0.0, 1.0, steps) / (11 * h)
    ws = Workspace.for_system(model.system)
    start = rigid_state(model, angles[0])
    return simulate(model.system, start, angles, rates, h, ws, divides=divides), angles, rates, ws


def fail_once(monkeypatch):
    """Make the step to instant 5 fail the first time; the list that is returned holds 5 then."""
    advance, failed = simulation._advance, []

    def once(system, integrator, first, last, *others):
        if first <= 5 < last and not failed:
            advance(system, integrator, first, 5, *others)
            failed.append(5)
            return newton.NOT_CONVERGED, 5, 0
        return advance(system, integrator, first, last, *others)

    monkeypatch.setattr(simulation, "_advance", once)
    return failed


def test_the_end_of_smaller_steps_is_a_guess_for_the_step_itself(monkeypatch):
    """Made to fail once, the step is found again, and its equations hold as if nothing had happened."""
    model = compiled(chain(2, driven=(0, 1), length=0.3))
    expected, angles, rates, ws = driven(model, 0.4)
    failed = fail_once(monkeypatch)
    with pytest.raises(SimulationFailure, match=f"{5 / 24:.4f}"):
        driven(model, 0.4, divides=False)
    failed.clear()
    found, *_ = driven(model, 0.4)
    assert failed and found.refined == ()
    for part in ("c", "q", "turn", "V", "lam"):
        one, other = getattr(found.states, part), getattr(expected.states, part)
        assert np.abs(one - other).max() < 1e-8 * max(1.0, np.abs(other).max()), part
    linearize(model.system, found, angles, rates, ws)


def test_a_run_with_subdivided_steps_has_no_gradient(monkeypatch):
    model = compiled(chain(2, driven=(0, 1), length=0.3))
    expected, angles, rates, ws = driven(model, 0.4)
    refined = refinement.refined_step
    fail_once(monkeypatch)
    monkeypatch.setattr(simulation, "refined_step", lambda *arguments: refined(*arguments) and False)
    found, *_ = driven(model, 0.4)
    assert found.refined == (5,)
    with pytest.raises(SimulationFailure, match="refined"):
        linearize(model.system, found, angles, rates, ws)


def test_a_jump_of_half_a_turn_is_taken_or_refused_but_never_not_a_number():
    model = compiled(chain(2, driven=(0, 1), length=0.3))
    for turn in (np.pi, 0.9 * np.pi, 3.0):
        try:
            trajectory, *_ = driven(model, turn)
        except SimulationFailure as failure:
            assert failure.time_s == pytest.approx(0.25) and failure.reason in ("diverged", "singular")
            continue
        assert all(np.all(np.isfinite(part)) for part in trajectory.states)
        assert trajectory.max_joint_gap < 1e-3
