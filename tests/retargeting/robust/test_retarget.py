"""Curves for a set of robots, on a small arm."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.model.uncertainty import RobustSettings, Uncertainty
from calmotion.retargeting.run_checks import check_search
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.workflow.targets import robustness_row
from posed import ignore_progress

OPTIONS = RunSettings(step=1 / 120, robust=RobustSettings("worst", 7, 20, 8.0))


@pytest.fixture(scope="module")
def result(arm, animation, bodies):
    return optimize_to_tolerance(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress)


def test_the_largest_error_over_the_robots_is_smaller_than_that_of_nominal_curves(result):
    found = result.robustness
    assert len(found.scenarios) >= 7 and len(found.drawn["robust"]) == 20
    before, nominal, robust = (found.drawn[name][..., 0].max() for name in ("before", "nominal", "robust"))
    assert robust < 0.9 * nominal < before


def test_the_error_on_the_model_is_within_what_is_allowed(arm, result):
    found, tolerance, own = result.robustness, tolerance_of(arm), result.robustness.nominal["nominal"]
    assert np.all(found.nominal["robust"][:, 0] <= np.maximum(8.0 * tolerance, own[:, 0]))


def test_what_is_measured_on_the_nominal_robot_is_what_the_result_has(result):
    judged, measured = result.after.motion.judged, result.robustness.nominal
    for name, simulation in (("robust", result.after), ("before", result.before)):
        simulated = [e[judged].max(axis=0) for e in (simulation.position_errors, simulation.rotation_errors)]
        assert np.allclose(measured[name], np.stack(simulated, axis=1), rtol=1e-6)


def test_the_error_of_the_simulation_is_estimated_as_for_one_robot(result):
    assert result.accuracy is not None and result.accuracy.step_m > 0.0
    assert sum("time step" in row.what for row in result.left_out) == 1


def test_an_interrupt_while_curves_are_measured_keeps_them(arm, animation, bodies):
    def interrupt(fraction, message):
        if message.startswith("measuring"):
            raise KeyboardInterrupt

    few = dataclasses.replace(OPTIONS, robust=RobustSettings("worst", 3, 4, 8.0))
    found = optimize_to_tolerance(compile_shot(arm, animation, bodies), few, interrupt)
    assert found.interrupted and found.search.stopped == "interrupted" and found.robustness is None
    assert found.objective_after < 0.1 * found.objective_before


def test_the_report_has_the_distribution_of_each_target(result):
    row = robustness_row(result, 0)["robustness"]
    assert set(row) == {"before", "nominal", "robust"}
    for values in row.values():
        for error in ("error_m", "rotation_error_rad"):
            assert values[f"median_max_{error}"] <= values[f"p95_max_{error}"] <= values[f"worst_max_{error}"]
    assert robustness_row(dataclasses.replace(result, robustness=None), 0) == {}


def test_a_robot_without_uncertainty_is_refused(arm, animation, bodies):
    known = dataclasses.replace(arm.retarget, uncertainty=Uncertainty(0.0, 0.0, 0.0, 0.0))
    shot = compile_shot(dataclasses.replace(arm, retarget=known), animation, bodies)
    with pytest.raises(ShotError, match="calm:retarget:uncertainty"):
        check_search(shot.character, animation, OPTIONS)  # before any mesh
