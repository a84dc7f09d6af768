"""The main job on a robot and a motion that nobody here made, with a layer of ours over them."""

import importlib.util
import json

import pytest
from pxr import Sdf, Usd


@pytest.mark.long
def test_the_shake_of_a_real_robot_with_soft_arms_is_removed(calmotion, repository, shared_data, tmp_path):
    folder = repository / "samples" / "real"
    spec = importlib.util.spec_from_file_location("compose", folder / "compose.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    shot = shared_data / "shots" / "g1_dual_arm_hands_chop.usda"
    composed = module.compose(folder / "g1_arms.usda", shot, tmp_path / "g1.usda", seconds=3.0)
    stage = Usd.Stage.Open(str(composed))
    assert stage.GetPrimAtPath("/g1_dual_arm/ABS").GetAttribute("physics:youngsModulus").Set(2e8)
    # two soft links are enough: a link of such a robot takes half a minute to mesh
    for prim in stage.Traverse():
        if prim.GetName().endswith("_shoulder_yaw_link"):
            assert prim.CreateAttribute("calm:flexible:enabled", Sdf.ValueTypeNames.Bool).Set(False)
    assert stage.GetEndTimeCode() == stage.GetStartTimeCode() + 180, "three of its eight seconds"
    stage.GetRootLayer().Save()
    done = calmotion(
        "optimize", composed, "-o", tmp_path / "calm.usda", "--json", "--step", "8.34ms", "--tolerance", "10mm",
        "--set", "retarget.optimize.max_iterations=2", "--set", "fe.mesh.element_size=25mm",
            "--set", "fem.reduce.elasticity=linear",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["pre_roll_s"] > 0.0, "the motion starts at speed"
    assert len(report["targets"]) == 2 and len(report["motors"]) == 14
    for target in report["targets"]:
        assert target["max_error_before_m"] > 0.03
        assert target["rms_error_after_m"] < 0.5 * target["rms_error_before_m"]
    assert (tmp_path / "calm.usda").is_file() and (tmp_path / "calm_root.usda").is_file()
