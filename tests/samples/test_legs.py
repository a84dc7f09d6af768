"""A real robot with closed loops: Disney's legs, walking with their pelvis held (the shared data)."""

from __future__ import annotations

import json


def test_legs_with_closed_chains_walk(calmotion, shared_data, tmp_path):
    shot = shared_data / "shots" / "dr_legs_walk.usda"
    done = calmotion("simulate", shot, "--json", "--quiet", "--step", "8.34ms")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["dof"] == 186  # 31 rigid bodies
    # six loops of rigid links and hinges stay closed, and a rigid robot does what was meant
    assert report["max_joint_gap_m"] < 1e-6
    assert {row["path"].rsplit("/", 1)[-1] for row in report["targets"]} == {"foot_l", "foot_r"}
    assert all(row["max_error_m"] < 1e-9 for row in report["targets"])
    assert report["newton_iterations"] < 4 * report["steps"]
