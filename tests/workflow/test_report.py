"""What a report tells of a run."""

from __future__ import annotations

import calmotion as cm
import pytest
from calmotion.workflow.report import still_targets
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
