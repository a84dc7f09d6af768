"""Stage units to SI."""

import pytest
from calmotion import ShotError
from calmotion.usd.units import StageUnits, other_units, units_of
from pxr import Usd, UsdGeom, UsdPhysics


def test_centimetres_and_grams_give_si():
    units = StageUnits(meters=0.01, kilograms=0.001)
    assert units.length(100.0) == pytest.approx(1.0)
    assert units.mass(1000.0) == pytest.approx(1.0)
    assert units.density(1.0) == pytest.approx(1000.0)  # 1 g/cm^3
    assert units.torque(1e7) == pytest.approx(1.0)  # 1e7 dyn cm
    assert units.force(1e5) == pytest.approx(1.0)  # 1e5 dyn
    assert units.pressure(10.0) == pytest.approx(1.0)  # 10 barye = 1 Pa
    assert units.inertia(1e7) == pytest.approx(1.0)
    assert units.acceleration(981.0) == pytest.approx(9.81)


def test_a_stage_without_units_has_usds_fallbacks():
    assert units_of(Usd.Stage.CreateInMemory()) == StageUnits(0.01, 1.0)


@pytest.mark.parametrize("value", [1e-300, 1e-10, 1e10, 1e300])
@pytest.mark.parametrize(
    ("name", "author"),
    [("metersPerUnit", UsdGeom.SetStageMetersPerUnit), ("kilogramsPerUnit", UsdPhysics.SetStageKilogramsPerUnit)],
)
def test_a_unit_that_nobody_measures_in_is_refused(name, author, value):
    stage = Usd.Stage.CreateInMemory()
    author(stage, value)
    with pytest.raises(ShotError, match="not one that lengths or masses are measured in") as error:
        units_of(stage)
    assert error.value.attribute == name and name in error.value.remedy


HEAD = "#usda 1.0\n(\n{}\n)\n"
METRES = 'metersPerUnit = 1\nupAxis = "Z"\nkilogramsPerUnit = 1'
ROBOT = HEAD.format(METRES) + 'def Xform "Arm"\n{\n    def Xform "link"\n    {\n    }\n}\n'


@pytest.mark.parametrize(
    ("shot", "names"),
    [
        (HEAD.format("subLayers = [@./robot.usda@]"), ["metersPerUnit", "upAxis"]),
        (HEAD.format("subLayers = [@./robot.usda@]\n" + METRES), []),
        (HEAD.format("metersPerUnit = 0.01") + 'def "Arm" (references = @./robot.usda@</Arm>) {}\n', ["metersPerUnit"]),
        (HEAD.format(METRES.replace("1", "1.0000001")) + 'def "Arm" (references = @./robot.usda@</Arm>) {}\n', []),
    ],
)
def test_units_of_the_robots_layer_that_the_root_layer_does_not_take_over_are_named(tmp_path, shot, names):
    """A root layer that sublayers a robot in metres and says nothing itself is in centimetres, Y up."""
    (tmp_path / "robot.usda").write_text(ROBOT)
    (tmp_path / "shot.usda").write_text(shot)
    stage = Usd.Stage.Open(str(tmp_path / "shot.usda"))
    found = other_units(stage, [stage.GetPrimAtPath("/Arm/link"), stage.GetPrimAtPath("/Arm/none")])
    assert [warning.attribute for warning in found] == names
    for warning in found:
        assert "robot.usda" in warning.message() and warning.path == "shot.usda"
