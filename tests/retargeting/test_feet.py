"""The search over changes of contacts: commands for a robot whose motors give, on its feet."""

from __future__ import annotations

import calmotion as cm
from steppers import TORSO, giving, write_stepper


def test_curves_make_a_robot_whose_motors_give_walk_as_intended(tmp_path):
    path = write_stepper(tmp_path / "stepper.usda", giving)
    before = cm.simulate(path, step=1 / 96).targets[f"{TORSO}/Head"].error.max()
    result = cm.optimize(path, step=1 / 96, tolerance="1mm")
    result.write(tmp_path / "calm.usda")
    after = cm.simulate(tmp_path / "calm_root.usda", step=1 / 96).targets[f"{TORSO}/Head"].error.max()
    assert before > 5e-3 and after < 0.1 * before
    # what was found is what the written curves do
    assert abs(result.targets[f"{TORSO}/Head"].error.max() - after) < 0.1 * after
