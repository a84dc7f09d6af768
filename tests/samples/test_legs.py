"""A real robot with closed loops: Disney's legs, walking with their pelvis held (the shared data)."""

import json

import pytest

LAYER = """#usda 1.0
(
    subLayers = [@{shot}@]
    startTimeCode = 0
    endTimeCode = {end}
    timeCodesPerSecond = 100
    metersPerUnit = 1
    upAxis = "Z"
)
over "DR_Legs"
{{
    over "Joints"
    {{
{drives}
    }}
}}
"""
DRIVE = """        over "{joint}" (
            prepend apiSchemas = ["PhysicsDriveAPI:angular"]
        )
        {{
            float drive:angular:physics:targetPosition.timeSamples = {{
                0: {angle},
                40: {angle},
            }}
        }}"""


def test_legs_with_closed_chains_walk(calmotion, shared_data, tmp_path):
    shot = shared_data / "shots" / "dr_legs_walk.usda"
    layer = tmp_path / "steps.usda"  # the first steps, with the full speed of almost all motors
    layer.write_text(LAYER.format(shot=shot, end=300, drives=""))
    done = calmotion("simulate", layer, "--json", "--quiet", "--step", "8.34ms")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["dof"] == 186  # 31 rigid bodies
    # six loops of rigid links and hinges stay closed, and a rigid robot does what was meant
    assert report["max_joint_gap_m"] < 1e-6
    assert {row["path"].rsplit("/", 1)[-1] for row in report["targets"]} == {"foot_l", "foot_r"}
    assert all(row["max_error_m"] < 1e-9 for row in report["targets"])
    assert report["newton_iterations"] < 4 * report["steps"]


@pytest.mark.parametrize(("joints", "angle"), [(["j8_l_i"], 4.0), (["j3_r_o"], -10.0), (["j4_l_i", "j9_r_i"], 25.0)])
def test_legs_with_more_motors_than_their_chains_can_follow_are_refused(
    calmotion, shared_data, tmp_path, joints, angle
):
    shot, layer = shared_data / "shots" / "dr_legs_walk.usda", tmp_path / "driven.usda"
    drives = "\n".join(DRIVE.format(joint=joint, angle=angle) for joint in joints)
    layer.write_text(LAYER.format(shot=shot, end=40, drives=drives))
    done = calmotion("simulate", layer, "--json", "--quiet")
    error = json.loads(done.stdout)["error"]
    assert done.returncode == 1 and "do not meet" in error["problem"] and error["path"].startswith("/DR_Legs/Joints/")
    assert "remove the drive" in error["remedy"] and "/DR_Legs/Joints/" in error["remedy"]
