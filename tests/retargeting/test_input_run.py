"""The input of a search by finer steps: its errors are those of a much finer run, at the instants of the search."""

import numpy as np
import pytest
from calmotion.errors import IntegrationError
from calmotion.model.run import RunSettings
from calmotion.retargeting import input_run
from calmotion.retargeting.input_run import OF_SHAKE, with_input_resolved
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.support import interrupts
from calmotion.tolerance.integrator_choice import SAFE
from posed import ignore_progress

OPTIONS = RunSettings(tolerance=1e-5)


@pytest.fixture(scope="module")
def shot(arm, animation, bodies):
    return compile_shot(arm, animation, bodies)


def simulated(shot, step, pre_roll=None):
    return simulate_shot(shot, RunSettings(step=step, pre_roll=pre_roll), ignore_progress)


@pytest.fixture(scope="module")
def rough(shot):
    return simulated(shot, 1 / 96)


@pytest.fixture(scope="module")
def fine(shot, rough):
    return simulated(shot, rough.step_s / 32 * (1 + 1e-9), rough.pre_roll_s).before.motion


def off(simulation, fine):
    """From a run with 32 times the steps [m]."""
    apart = simulation.motion.target_positions - fine.target_positions[::32]
    return float(np.linalg.norm(apart, axis=2).max())


def test_it_is_known_to_a_hundredth_of_its_error(shot, rough, fine):
    found = with_input_resolved(rough, shot, OPTIONS).before
    allowed = OF_SHAKE * rough.before.position_errors.max()
    assert off(rough.before, fine) > 2.0 * allowed, "a search knows it by its coarse step only"
    assert off(found, fine) < allowed


def test_it_has_the_instants_of_the_search_and_all_its_columns(shot, rough):
    found = with_input_resolved(rough, shot, OPTIONS).before
    np.testing.assert_allclose(found.motion.times, rough.before.motion.times, atol=1e-12)
    for name in ("positions", "rotations", "motor_values", "motor_efforts", "target_rotations", "joint_forces"):
        assert getattr(found.motion, name).shape == getattr(rough.before.motion, name).shape
    assert [u.shape for u in found.motion.elastic] == [u.shape for u in rough.before.motion.elastic]
    assert found.position_errors.shape == found.rotation_errors.shape == rough.before.position_errors.shape
    intended = rough.reference.target_positions
    errors = np.linalg.norm(found.motion.target_positions - intended, axis=2)
    np.testing.assert_allclose(found.position_errors, errors, atol=1e-9)


def test_a_tolerance_above_it_needs_one_simulation(shot, rough, monkeypatch):
    steps = []

    def counted(shot, options, progress):
        steps.append(options.step)
        return simulate_shot(shot, options, progress)

    monkeypatch.setattr(input_run, "simulate_shot", counted)
    with_input_resolved(rough, shot, RunSettings(tolerance=0.05))
    assert steps == [pytest.approx(rough.step_s)]
    del steps[:]
    with_input_resolved(rough, shot, OPTIONS)
    assert len(steps) > 1


def test_where_the_fast_integrator_fails_the_safe_one_takes_half_the_steps(shot, rough, fine, monkeypatch):
    def slow_only(shot, options, progress):
        if options.scheme != SAFE:
            raise IntegrationError("no step", path="/Arm", remedy="none")
        return simulate_shot(shot, options, progress)

    monkeypatch.setattr(input_run, "simulate_shot", slow_only)
    found = with_input_resolved(rough, shot, OPTIONS).before
    assert off(found, fine) < 0.5 * off(rough.before, fine)


def test_it_stays_where_finer_steps_fail(shot, rough, monkeypatch):
    def fails(*args):
        raise IntegrationError("no step", path="/Arm", remedy="none")

    monkeypatch.setattr(input_run, "simulate_shot", fails)
    assert with_input_resolved(rough, shot, OPTIONS).before is rough.before


def test_an_interrupt_keeps_the_curves(shot, rough, monkeypatch):
    def interrupt(*args):
        interrupts.request()
        interrupts.check()

    monkeypatch.setattr(input_run, "simulate_shot", interrupt)
    found = with_input_resolved(rough, shot, OPTIONS)
    assert found.interrupted and found.before is rough.before
    interrupts.check()  # it was answered


def test_a_search_tells_it_unless_its_step_is_given(shot):
    found = optimize_to_tolerance(shot, RunSettings(tolerance=2e-3), ignore_progress)
    finest = simulated(shot, found.step_s / 16, found.pre_roll_s).before
    told, truth = (run.position_errors.max() for run in (found.before, finest))
    assert told == pytest.approx(truth, abs=2e-3)
    given = optimize_to_tolerance(shot, RunSettings(step=found.step_s), ignore_progress)
    alone = simulate_shot(shot, RunSettings(step=found.step_s), ignore_progress)
    np.testing.assert_allclose(given.before.position_errors, alone.before.position_errors, atol=1e-9)
