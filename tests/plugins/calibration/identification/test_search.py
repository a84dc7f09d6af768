"""The start and the steps of a search."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.recordings import MARKER
from calmotion_plugins.calibration.identification import search
from recorded import PLASTIC, only, problem_of


def quiet(fraction, message):
    """Progress that nobody reads."""


def test_a_search_begins_near_the_stiffness_of_the_robot(recorded_shot, recordings):
    problem = problem_of(recorded_shot, only(recordings, MARKER))
    starts = search._starts(problem, quiet)
    modulus = problem.parameters[0]
    assert modulus.name == f"modulus {PLASTIC}"
    # the truth is 2.15 GPa; robots that are tried lie 8% apart
    assert modulus.value(starts[0][0]) == pytest.approx(2.15e9, rel=0.09)


def test_noise_follows_from_residuals_unless_it_is_given(recorded_shot, recordings):
    problem = problem_of(recorded_shot, only(recordings, MARKER))
    z = np.zeros(len(problem.lower))
    shaken = search.renoised(problem, z)
    assert shaken.sensors[0].sigma > 3.0 * problem.measurement.sensors[0].sigma
    given = dataclasses.replace(problem.measurement.sensors[0].channel, sigma=4e-4)
    sensor = dataclasses.replace(problem.measurement.sensors[0], channel=given)
    known = problem.with_measurement(problem.measurement.with_sensors([sensor]))
    assert search.renoised(known, z).sensors[0].sigma == 4e-4


def test_the_parameters_of_the_measurement_alone_need_no_simulation(recorded_shot, recordings):
    problem = problem_of(recorded_shot, only(recordings, MARKER))
    z = np.zeros(len(problem.lower))
    problem.signals(z)
    before = problem.simulations
    fitted, cost = search.profiled(problem, z)
    assert problem.simulations == before and np.all(fitted[:3] == 0.0)
    assert cost < 0.5 * float(problem.residuals(z) @ problem.residuals(z))


def test_robots_of_which_none_can_be_simulated_are_refused(recorded_shot, recordings, monkeypatch):
    problem = problem_of(recorded_shot, only(recordings, MARKER))

    def fails(*arguments):
        raise ShotError("it diverges")

    monkeypatch.setattr("calmotion_plugins.calibration.identification.problem.signals_of", fails)
    with pytest.raises(ShotError, match="neither the robot nor"):
        search._starts(problem, quiet)


def test_a_step_whose_error_is_above_the_noise_is_halved_before_parameters_are_fitted(recorded_shot, recordings):
    problem = problem_of(recorded_shot, only(recordings, MARKER))
    z = np.zeros(len(problem.lower))

    def resolved(sigma):
        sensor = dataclasses.replace(problem.measurement.sensors[0], sigma=sigma)
        return search._resolved(problem.with_measurement(problem.measurement.with_sensors([sensor])), z, 3)

    coarse, left = resolved(1.0)
    assert left == 3 and search.step_of(coarse) == search.step_of(problem)
    finest, left = resolved(1e-12)
    assert left == 0 and search.step_of(finest) == search.step_of(problem) / 8.0
    # errors of a step fall with its square: half the noise takes one halving more
    half = problem.with_options(dataclasses.replace(problem.options, step=0.5 * search.step_of(problem)))
    off = np.sqrt(np.mean((half.residuals(z) - problem.residuals(z)) ** 2)) * problem.measurement.sensors[0].sigma
    assert resolved(1.1 * off / search.COARSE)[1] == 3 and resolved(0.5 * off / search.COARSE)[1] == 2


def test_a_minimum_of_a_coarse_step_that_is_far_is_searched_anew(recorded_shot, recordings, monkeypatch):
    problem = problem_of(recorded_shot, only(recordings, MARKER))
    z = search._starts(problem, quiet)[0]
    begun = search.minimize(problem, z, problem.lower, 4)
    made = []
    minimize = search.minimize
    monkeypatch.setattr(search, "minimize", lambda *a: (made.append(a), minimize(*a))[1])
    monkeypatch.setattr(search, "chord", lambda *a: None)
    found = search._converged(problem, begun, 4, 2)
    assert len(made) == 2 and np.array_equal(made[0][1], begun.z)
    assert found.iterations > 6 and search.step_of(found.problem) == search.step_of(problem) / 4.0


def test_what_converged_is_kept_where_halving_the_step_is_interrupted(recorded_shot, recordings, monkeypatch):
    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(search, "chord", stopped)
    problem = problem_of(recorded_shot, only(recordings, MARKER))
    found = search.search(problem, quiet, halvings=2)
    assert found.interrupted and found.solution.converged and np.all(np.isfinite(found.covariance))
