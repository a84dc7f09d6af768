"""The start and the steps of a search."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.recordings import MARKER
from calmotion_plugins.calibration.identification import search
from calmotion_plugins.calibration.identification.problem import Calibrated
from recorded import only, problem_of


def quiet(fraction, message):
    """Progress that nobody reads."""


def test_noise_follows_from_residuals_unless_it_is_given(recorded_shot, recordings):
    problem = problem_of(recorded_shot, only(recordings, MARKER))
    z = np.zeros(len(problem.lower))
    shaken = search.renoised(problem, z)
    assert shaken.sensors[0].sigma > 3.0 * problem.measurement.sensors[0].sigma
    given = dataclasses.replace(problem.measurement.sensors[0].channel, sigma=4e-4)
    sensor = dataclasses.replace(problem.measurement.sensors[0], channel=given)
    known = problem.with_measurement(problem.measurement.with_sensors([sensor]))
    assert search.renoised(known, z).sensors[0].sigma == 4e-4


def test_robots_of_which_none_can_be_simulated_are_refused(recorded_shot, recordings, monkeypatch):
    problem = problem_of(recorded_shot, only(recordings, MARKER))

    def fails(*arguments):
        raise ShotError("it diverges")

    monkeypatch.setattr("calmotion_plugins.calibration.identification.problem.signals_of", fails)
    with pytest.raises(ShotError, match="neither the robot nor"):
        search.search(problem, quiet, halvings=0)


@pytest.mark.parametrize("failure", [KeyboardInterrupt(), ShotError("it diverges")])
def test_what_converged_is_kept_where_halving_the_step_ends(recorded_shot, recordings, monkeypatch, failure):
    def stopped(*_):
        raise failure

    monkeypatch.setattr(search, "chord", stopped)
    problem = problem_of(recorded_shot, only(recordings, MARKER))
    found = search.search(problem, quiet, halvings=2)
    assert found.interrupted == isinstance(failure, KeyboardInterrupt)
    assert found.solution.converged and np.all(np.isfinite(found.covariance))


@pytest.mark.parametrize("simulations", [0, 25, 32, 40, 50])
def test_an_interrupt_keeps_the_best_estimates_so_far(recorded_shot, recordings, simulations):
    problem = problem_of(recorded_shot, only(recordings, MARKER))
    counted = []

    def tell():
        counted.append(1)
        if len(counted) == simulations + 1:
            raise KeyboardInterrupt

    own = Calibrated(problem.takes, problem.measurement, problem.options, tell)
    if not simulations:  # there is nothing yet
        with pytest.raises(KeyboardInterrupt):
            search.search(own, quiet, halvings=2)
        return
    found = search.search(own, quiet, halvings=2)
    assert found.interrupted and np.all(np.isfinite(found.covariance)) and found.shift == 0.0
    before, after = (np.abs(problem.residuals(z)).mean() for z in (np.zeros(len(found.z)), found.z))
    assert after <= before


def test_halving_ends_where_estimates_stay_though_each_step_needs_derivatives_of_its_own(
    recorded_shot, recordings, monkeypatch
):
    monkeypatch.setattr(search, "chord", lambda *_: None)
    found = search.search(problem_of(recorded_shot, only(recordings, MARKER)), quiet, halvings=3)
    assert found.shift < search.SHIFT
