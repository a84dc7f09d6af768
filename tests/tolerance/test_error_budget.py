"""The error budget of a result has an entry for each approximation, and their sum is the estimated error."""

import dataclasses

import pytest
from calmotion.model import ModelChoice, ModelChoices
from calmotion.model.model_choice import with_choices
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import CHOICES, MESH, REDUCTION, SEARCH, STEP, SUBSPACE, verdict_on
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.error_budget import with_budget
from calmotion.tolerance.simulation import simulate_to_tolerance

TOLERANCE = 2e-3


def quiet(fraction, message):
    pass


@pytest.fixture(scope="module")
def simulated(arm, animation, bodies):
    return simulate_to_tolerance(compile_shot(arm, animation, bodies), RunSettings(tolerance=TOLERANCE), quiet)


def test_the_entries_add_up_to_the_estimates_largest_first(simulated, arm):
    rows = (ModelChoice("turning", "Base: no gyroscopic terms", False, "it does not rotate", 1e-4),)
    chosen = with_choices(simulated, ModelChoices(arm, rows))
    result = with_budget(chosen, arm, TOLERANCE)
    entries = {entry.source: entry for entry in result.budget}
    assert set(entries) == {MESH, STEP, REDUCTION, SUBSPACE, CHOICES} and result.tolerance_m == TOLERANCE
    estimates = [entry.estimated_m or 0.0 for entry in result.budget]
    assert estimates == sorted(estimates, reverse=True)
    assert entries[STEP].estimated_m == result.accuracy.step_m and entries[CHOICES].estimated_m == 1e-4
    without_mesh = sum(entry.estimated_m for entry in result.budget if entry.source != MESH)
    assert without_mesh == pytest.approx(result.accuracy.estimated_m)
    assert entries[MESH].allowed_m == pytest.approx(max(TOLERANCE - without_mesh, 0.25 * TOLERANCE))
    assert "time step" in entries[STEP].choice and "gyroscopic" in entries[CHOICES].choice


def test_a_larger_mesh_error_decides_the_verdict(simulated, arm):
    for mesh, kept in ((0.0, True), (2.0 * TOLERANCE, False)):
        accuracy = dataclasses.replace(simulated.accuracy, mesh_m=mesh)
        result = with_budget(dataclasses.replace(simulated, accuracy=accuracy), arm, TOLERANCE)
        verdict = verdict_on(result.budget, TOLERANCE)
        assert (verdict.kept, verdict.short) == (kept, "" if kept else MESH)


@pytest.mark.parametrize(
    "requested, error, counted", [(None, 0.03, False), (None, 0.05, True), (TOLERANCE, 0.03, True)]
)
def test_a_mesh_that_is_finer_than_the_modulus_is_known_counts_only_where_a_tolerance_is_asked_for(
    simulated, arm, requested, error, counted
):
    known = dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, tolerance=None))
    modes = tuple(dataclasses.replace(table, mesh_error=error) for table in simulated.modes)
    accuracy = dataclasses.replace(simulated.accuracy, mesh_m=1.0)
    result = with_budget(dataclasses.replace(simulated, accuracy=accuracy, modes=modes), known, requested)
    assert verdict_on(result.budget, 1.0).kept != counted
    told = [row for row in result.left_out if "modulus is known to 10%" in row.why]
    assert len(told) == (requested is None)


def test_a_given_step_is_estimated_and_falls_short_where_it_is_too_long(arm, animation, bodies):
    options = RunSettings(tolerance=1e-4, step=1 / 120)
    result = with_budget(simulate_to_tolerance(compile_shot(arm, animation, bodies), options, quiet), arm, 1e-4)
    step = next(entry for entry in result.budget if entry.source == STEP)
    assert step.estimated_m > 1e-4 and step.reason == "given by --step"
    # the meshes keep their share of it, which the step has used
    assert next(entry for entry in result.budget if entry.source == MESH).allowed_m == pytest.approx(0.25e-4)
    verdict = verdict_on([entry for entry in result.budget if entry.source != MESH], 1e-4)
    assert not verdict.kept and verdict.short == STEP


def test_a_search_is_said_to_be_ended_by_the_tolerance_or_before(arm, animation, bodies):
    shot = compile_shot(arm, animation, bodies)
    for tolerance, most, share in ((TOLERANCE, 30, 0.1), (0.1 * TOLERANCE, 1, None)):
        options = RunSettings(tolerance=tolerance, max_iterations=most)
        result = with_budget(optimize_to_tolerance(shot, options, quiet), arm, TOLERANCE)
        search = next(entry for entry in result.budget if entry.source == SEARCH)
        assert search.allowed_m == pytest.approx(0.1 * TOLERANCE)
        assert search.estimated_m == (None if share is None else pytest.approx(share * TOLERANCE))


def test_an_interrupted_result_without_estimates_has_no_budget(simulated, arm):
    result = with_budget(dataclasses.replace(simulated, accuracy=None), arm, None)
    assert result.budget == () and result.tolerance_m > 0.0
