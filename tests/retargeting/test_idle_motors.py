"""What idle motors promise, against a search with them; and searches that take them in after all."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.model.model_choice import ON
from calmotion.model.run import RunSettings
from calmotion.multibody.model.topology import span_tree
from calmotion.retargeting import to_tolerance
from calmotion.retargeting.left_out import idle_motors
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.body_reduction import load_envelopes
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.simplification.analysis import analyse
from posed import ignore_progress
from simplification_shots import arm_with_head

FAST = RunSettings(step=1 / 60)


@pytest.fixture(scope="module")
def shot():
    return arm_with_head()


@pytest.fixture(scope="module")
def bodies(shot):
    loads = load_envelopes(shot.character, shot.animation, shot.meshes, FAST)
    return reduce_bodies(shot.character, span_tree(shot.character), shot.meshes, None, loads)


def _marked(shot, forced=None):
    return analyse(shot.character, shot.animation, FAST, forced or {}, True).character


@pytest.fixture(scope="module")
def lean(shot, bodies):
    return optimize_shot(compile_shot(_marked(shot), shot.animation, bodies), FAST, ignore_progress)


def test_a_motor_of_the_head_is_not_optimised_and_the_loss_is_small(shot, bodies, lean):
    assert list(idle_motors(_marked(shot))) == [2, 3]
    every = optimize_shot(compile_shot(_marked(shot, {"motors": ON}), shot.animation, bodies), FAST, ignore_progress)
    assert [curve.changed for curve in lean.curves] == [True, True, False, False]
    assert lean.search.parameters < every.search.parameters and every.search.idle_gain_m is None
    unit = np.sqrt(2.0 * lean.objective_after / np.mean(lean.after.position_errors[lean.after.motion.judged] ** 2))
    lost = (np.sqrt(2.0 * lean.objective_after) - np.sqrt(2.0 * every.objective_after)) / unit
    assert 0.0 <= lean.search.idle_gain_m < 1e-3
    assert lost < max(5.0 * lean.search.idle_gain_m, 2e-5)
    rows = {row.what: row for row in lean.left_out}
    assert rows["/Arm/Nod: not optimised"].estimated_error_m == lean.search.idle_gain_m
    assert "/Arm/Shake: not optimised" in rows and "/Arm/Nod: curve unchanged" not in rows


def test_the_search_continues_on_finer_knots_where_they_promise_a_gain(shot, bodies, monkeypatch):
    monkeypatch.setattr(to_tolerance, "JOINING_GAIN", -1.0)
    result = optimize_to_tolerance(compile_shot(_marked(shot), shot.animation, bodies), FAST, ignore_progress)
    assert result.search.idle_gain_m is None
    assert not any("Nod" in row.what and "moves no target" in row.why for row in result.left_out)
    kept = optimize_to_tolerance(
        compile_shot(_marked(shot), shot.animation, bodies), replace(FAST, motors="off"), ignore_progress
    )
    assert kept.search.idle_gain_m is not None and kept.search.parameters < result.search.parameters
