"""Curves for a set of robots, on a small arm."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.retargeting.run_checks import check_search
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.shot.robust.settings import RobustSettings, Uncertainty
from calmotion.shot.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.workflow.robustness import robustness_row
from posed import ignore_progress

OPTIONS = RunSettings(step=1 / 120, robust=RobustSettings("worst", 3, 20, 2))


@pytest.fixture(scope="module")
def result(arm, animation, bodies):
    return optimize_to_tolerance(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress)


def test_the_largest_error_over_the_robots_is_smaller_than_that_of_nominal_curves(result):
    found = result.robustness
    assert len(found.scenarios) == 3 and len(found.drawn["robust"]) == 20
    before, nominal, robust = (found.drawn[name].max() for name in ("before", "nominal", "robust"))
    assert robust < 0.9 * nominal < before


def test_compromises_lie_between_robust_and_nominal_curves(result):
    found = result.robustness
    weights = [row.weight for row in found.compromises]
    assert len(weights) == 2 and found.scenarios[0].weight < weights[0] < weights[1] < 1.0
    on_model = [found.nominal["robust"].max(), *(row.nominal.max() for row in found.compromises)]
    worst = [found.drawn["robust"].max(), *(row.drawn.max() for row in found.compromises)]
    assert on_model[0] > on_model[1] > on_model[2] and worst[0] < worst[2]
    assert all(row.drawn.shape == found.drawn["robust"].shape for row in found.compromises)


def test_what_is_measured_on_the_nominal_robot_is_what_the_result_has(result):
    judged, measured = result.after.motion.judged, result.robustness.nominal
    for name, simulation in (("robust", result.after), ("before", result.before)):
        assert np.allclose(measured[name], simulation.position_errors[judged].max(axis=0), rtol=1e-6)


def test_the_error_of_the_simulation_is_estimated_as_for_one_robot(result):
    assert result.accuracy is not None and result.accuracy.step_m > 0.0
    assert sum("time step" in row.what for row in result.left_out) == 1


def test_an_interrupt_while_curves_are_measured_keeps_them(arm, animation, bodies):
    def interrupt(fraction, message):
        if message.startswith("measuring"):
            raise KeyboardInterrupt

    found = optimize_to_tolerance(compile_shot(arm, animation, bodies), OPTIONS, interrupt)
    assert found.interrupted and found.stopped == "interrupted" and found.robustness is None
    assert found.objective_after < 0.1 * found.objective_before


def test_the_report_has_the_distribution_of_each_target(result):
    row = robustness_row(result, 0)["robustness"]
    assert set(row) == {"before", "nominal", "robust"}
    for values in row.values():
        assert values["median_max_error_m"] <= values["p95_max_error_m"] <= values["worst_max_error_m"]
    assert robustness_row(dataclasses.replace(result, robustness=None), 0) == {}


def test_a_robot_without_uncertainty_is_refused(arm, animation, bodies):
    known = dataclasses.replace(arm.retarget, uncertainty=Uncertainty(0.0, 0.0, 0.0, 0.0))
    shot = compile_shot(dataclasses.replace(arm, retarget=known), animation, bodies)
    with pytest.raises(ShotError, match="calm:retarget:uncertainty"):
        check_search(shot.character, animation, OPTIONS)  # before any mesh
