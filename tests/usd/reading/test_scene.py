"""Gravity, and the settings of the optimisation."""

import numpy as np
import pytest
from calmotion.model.uncertainty import Uncertainty
from calmotion.usd.reading import read_shot
from pxr import Gf, Sdf, UsdGeom, UsdPhysics
from small_shots import BASE, FORE, Scale, set_float, write_arm


def read(tmp_path, edit=None, scale=None):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit, scale)))[0]


def scene(stage, direction=None, magnitude=None):
    made = UsdPhysics.Scene.Define(stage, "/scene")
    if direction is not None:
        made.CreateGravityDirectionAttr(Gf.Vec3f(*direction))
    if magnitude is not None:
        made.CreateGravityMagnitudeAttr(magnitude)


def test_without_a_scene_gravity_is_the_earths_down_the_up_axis(tmp_path):
    assert read(tmp_path).gravity.tolist() == [0, 0, -9.81]
    assert read(tmp_path, lambda s: UsdGeom.SetStageUpAxis(s, "Y")).gravity.tolist() == [0, -9.81, 0]


@pytest.mark.parametrize(
    ("direction", "magnitude", "expected"),
    [
        (None, None, [0, 0, -9.81]),
        ((0, 0, 0), -1.0, [0, 0, -9.81]),
        ((2, 0, 0), 162.0, [1.62, 0, 0]),
        ((0, 0, -1), 0.0, [0, 0, 0]),
        ((0, 0, 0), 981.0, [0, 0, -9.81]),
    ],
)
def test_the_conventions_of_usdphysics_are_followed(tmp_path, direction, magnitude, expected):
    found = read(tmp_path, lambda stage: scene(stage, direction, magnitude), Scale(0.01, 1.0)).gravity
    assert np.allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize("on", [False, True])
def test_newton_can_switch_gravity_off(tmp_path, on):
    def edit(stage):
        scene(stage)
        stage.GetPrimAtPath("/scene").CreateAttribute("newton:gravityEnabled", Sdf.ValueTypeNames.Bool).Set(on)

    assert read(tmp_path, edit).gravity.tolist() == [0.0, 0.0, -9.81 * on]


def test_of_several_scenes_that_of_the_bodies_counts(tmp_path):
    def edit(stage, *owners):
        for name, magnitude in (("earth", 9.81), ("moon", 1.62)):
            UsdPhysics.Scene.Define(stage, f"/{name}").CreateGravityMagnitudeAttr(magnitude)
        for path, owner in zip((BASE, FORE), owners, strict=False):
            UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(path)).CreateSimulationOwnerRel().SetTargets([owner])

    for owners, expected, told in (
        ((), -9.81, True),
        (("/moon", "/moon"), -1.62, False),
        (("/earth", "/moon"), -9.81, True),
    ):
        found = read(tmp_path, lambda stage, owners=owners: edit(stage, *owners))
        assert np.allclose(found.gravity, [0, 0, expected], atol=1e-6)
        assert told == any("several PhysicsScene" in note for note in found.notes)


def retarget(stage, path: str, **values) -> None:
    prim = stage.GetPrimAtPath(path)
    prim.AddAppliedSchema("CalmRetargetAPI")
    for name, value in values.items():
        kind = {str: Sdf.ValueTypeNames.Token, bool: Sdf.ValueTypeNames.Bool}.get(type(value), Sdf.ValueTypeNames.Float)
        prim.CreateAttribute(f"calm:retarget:{name}", kind).Set(value)


def test_settings_are_automatic_until_authored(tmp_path):
    for character in (read(tmp_path), read(tmp_path, lambda stage: retarget(stage, "/Arm"))):
        found = character.retarget
        assert (found.tolerance, found.goal, found.time_step, found.knot_spacing, found.smoothness) == (None,) * 5
        assert (found.reference, found.endpoints, found.cyclic) == ("rigid", "free", False)


def test_authored_settings_are_read_in_si(tmp_path):
    def edit(stage):
        retarget(
            stage, "/Arm", tolerance=0.1, goal=0.5, timeStep=0.002, knotSpacing=0.05, smoothness=0.0,
            reference="static", endpoints="kept", cyclic=True,
        )  # fmt: skip

    found = read(tmp_path, edit, Scale(0.01, 1.0)).retarget
    assert found.tolerance == pytest.approx(1e-3) and found.goal == pytest.approx(5e-3)
    assert found.time_step == pytest.approx(0.002)
    assert found.knot_spacing == pytest.approx(0.05) and found.smoothness == 0.0
    assert (found.reference, found.endpoints, found.cyclic) == ("static", "kept", True)


def test_what_is_uncertain_of_the_robot_is_read(tmp_path):
    assert read(tmp_path).retarget.uncertainty == Uncertainty()

    def edit(stage):
        retarget(stage, "/Arm", **{"uncertainty:modulus": 0.25, "uncertainty:payload": 0.0, "uncertainty:gains": 0.5})

    assert read(tmp_path, edit).retarget.uncertainty == Uncertainty(modulus=0.25, payload=0.0, gains=0.5)


def test_the_settings_are_those_above_the_character_not_those_below(tmp_path):
    character = read(tmp_path, lambda stage: retarget(stage, FORE, tolerance=0.1))
    assert character.retarget.tolerance is None
    assert any("CalmRetargetAPI" in note and FORE in note for note in character.notes)


def test_attributes_without_the_schema_on_them_change_nothing(tmp_path):
    assert read(tmp_path, lambda s: set_float(s, "/Arm", "calm:retarget:tolerance", 1.0)).retarget.tolerance is None
