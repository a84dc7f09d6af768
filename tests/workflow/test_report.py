"""What a report tells of a run."""

from dataclasses import replace

import calmotion as cm
import numpy as np
import pytest
from calmotion.model.limits.use import TermUse
from calmotion.workflow.report import main_target, remaining_errors, still_targets
from pxr import UsdGeom
from small_shots import FORE, UPPER, make_target, write_arm


@pytest.mark.parametrize(("body", "along", "expected"), [(UPPER, 0.0, True), (UPPER, 0.2, False), (FORE, 0.0, False)])
def test_a_target_at_the_hinge_of_a_link_that_nothing_moves_is_named(tmp_path, body, along, expected):
    path = f"{body}/point"

    def edit(stage):
        place = UsdGeom.Xform.Define(stage, path)
        place.AddTranslateOp().Set((along, 0.0, 0.0))
        make_target(stage, path)

    found = cm.simulate(write_arm(tmp_path / "arm.usda", edit), step=1 / 120, pre_roll=0.0)
    assert still_targets(found.shot.character, found.result) == [path] * expected


def test_the_main_target_and_the_causes_of_what_remains_follow_from_weights_motors_and_limits(tmp_path):
    found = cm.optimize(write_arm(tmp_path / "arm.usda"), step=1 / 48, pre_roll=0.0)
    character, result = found.shot.character, replace(found.result, tolerance_m=0.0, limits=())
    result = replace(result, search=replace(result.search, stopped="converged"))
    (tip,) = character.targets
    assert main_target(character, result) == tip.path
    (row,) = remaining_errors(character, result)
    assert row["path"] == tip.path and row["max_error_m"] == found.max_error
    assert (row["directions"], row["motors"], row["causes"]) == (3, 2, ["motors"])
    ended = replace(result, search=replace(result.search, stopped="no further decrease"))
    assert remaining_errors(character, ended)[0]["causes"][0] == "search"
    for term, causes in (
        (TermUse("speed", "m/s", "", 2.0, 1.0), ["plugins", "motors"]),
        (TermUse("speed", "m/s", "", 2.0, 1.0, limit=1.0, excess=0.0), ["plugins", "motors"]),
        (TermUse("speed", "m/s", "", 2.0, 1.0, limit=2.0, excess=-0.5), ["motors"]),
    ):
        assert remaining_errors(character, replace(result, terms=(term,)))[0]["causes"] == causes
    assert remaining_errors(character, replace(result, tolerance_m=1.0)) == []
    assert remaining_errors(character, replace(result, after=None)) == []
    still = np.full_like(result.after.position_errors, row["max_error_m"])  # as far off at rest
    for sag, causes in ((0.0, ["motors"]), (2.0 * row["max_error_m"], ["sag", "motors"])):
        resting = replace(result, after=replace(result.after, position_errors=still, sag=np.array([sag])))
        assert remaining_errors(character, resting)[0]["causes"] == causes, "gravity alone is blamed for what it moves"
    eased = replace(result.after.motion, times=result.after.motion.times - result.after.motion.times[1])
    lifted = np.where(eased.times[:, None] < -1e-9, still, 0.0)
    lifted[-1] = row["max_error_m"]
    swinging = replace(result.after, motion=eased, position_errors=lifted, sag=2.0 * still[0])
    assert remaining_errors(character, replace(result, after=swinging))[0]["causes"] == ["motors"], "not of a pre-roll"
    light = replace(tip, path="/light", position_weight=0.5)
    two = replace(character, targets=(light, tip))
    errors = replace(result.before, position_errors=np.repeat(result.before.position_errors, 2, axis=1))
    assert main_target(two, replace(result, before=errors)) == tip.path
