"""The search over changes of contacts: commands for a robot whose motors give, on its feet."""

import calmotion as cm
import pytest
from pxr import Sdf, UsdShade
from steppers import LEGS, ROBOT, TORSO, giving, write_stepper


def test_curves_make_a_robot_whose_motors_give_walk_as_intended(tmp_path):
    path = write_stepper(tmp_path / "stepper.usda", giving)
    animated = cm.simulate(path, step=1 / 96)
    before = animated.targets[f"{TORSO}/Head"].error.max()
    result = cm.optimize(path, step=1 / 96, tolerance="1mm")
    result.write(tmp_path / "calm.usda")
    calm = cm.simulate(tmp_path / "calm_root.usda", step=1 / 96)
    after = calm.targets[f"{TORSO}/Head"].error.max()
    assert before > 5e-3 and after < 0.1 * before
    # what was found is what the written curves do
    assert abs(result.targets[f"{TORSO}/Head"].error.max() - after) < 0.1 * after
    stand_as_well(animated, calm)


def stand_as_well(animated, calm):
    """No foot asks of the ground what it cannot do, nor lands faster than animated."""
    for was, now in zip(animated.report()["contacts"], calm.report()["contacts"], strict=True):
        assert now["unlike_ground"] == []
        if was["landing_speed_m_s"] is not None:
            assert now["landing_speed_m_s"] < max(1.05 * was["landing_speed_m_s"], 9e-3)


@pytest.mark.long
def test_a_foot_that_is_no_target_lands_and_stands_as_animated(tmp_path):
    # without limits of the ground the swinging foot landed with 0.94 m/s, and pulled
    path = write_stepper(tmp_path / "stepper.usda", lambda stage: soften(stage, 3e8))
    animated, calm = cm.simulate(path, step=1 / 96), cm.optimize(path, step=1 / 96, tolerance="1mm")
    assert calm.result.objective_after < calm.result.objective_before
    stand_as_well(animated, calm)


def soften(stage, modulus):
    """Thighs of a flexible material [Pa]."""
    prim = UsdShade.Material.Define(stage, f"{ROBOT}/Plastic").GetPrim()
    prim.AddAppliedSchema("PhysicsVolumeDeformableMaterialAPI")
    for name, value in (("youngsModulus", modulus), ("poissonsRatio", 0.35), ("density", 1200.0)):
        prim.CreateAttribute(f"physics:{name}", Sdf.ValueTypeNames.Float).Set(value)
    for side in LEGS:
        thigh = stage.GetPrimAtPath(f"{ROBOT}/{side}/Thigh")
        thigh.ApplyAPI("CalmFlexibleBodyAPI")
        thigh.RemoveProperty("physics:mass")
        binding = UsdShade.MaterialBindingAPI.Apply(thigh)
        binding.Bind(UsdShade.Material(prim), UsdShade.Tokens.weakerThanDescendants, "physics")
