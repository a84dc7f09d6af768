"""Elastic materials: found, converted, refused."""

from __future__ import annotations

import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from pxr import Sdf, UsdShade
from small_shots import FORE, PLASTIC, Scale, make_flexible, set_float, write_arm


def material(tmp_path, edit=None, scale=None, **values):
    def flexible(stage):
        make_flexible(stage, scale=scale, **values)
        if edit:
            edit(stage)

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", flexible, scale)))
    return next(b for b in character.bodies if b.path == FORE).flexible.material


@pytest.mark.parametrize("scale", [Scale(), Scale(0.01, 0.001), Scale(0.01, 1.0)])
def test_stage_units_become_si(tmp_path, scale):
    found = material(tmp_path, scale=scale)
    assert found.path == PLASTIC
    assert found.youngs_modulus == pytest.approx(2e9, rel=1e-6)
    assert found.poissons_ratio == pytest.approx(0.4)
    assert found.density == pytest.approx(1100.0, rel=1e-6)
    assert found.damping_ratio == pytest.approx(0.01) and found.rayleigh is None


def test_damping_is_read_from_its_schema(tmp_path):
    def edit(stage):
        stage.GetPrimAtPath(PLASTIC).AddAppliedSchema("CalmDampingAPI")
        set_float(stage, PLASTIC, "calm:damping:ratio", 0.03)
        set_float(stage, PLASTIC, "calm:damping:rayleighStiffness", 2e-4)

    found = material(tmp_path, edit)
    assert found.damping_ratio == pytest.approx(0.03)
    assert found.rayleigh == pytest.approx((0.0, 2e-4))


def test_a_material_bound_to_the_geometry_alone_counts(tmp_path):
    def edit(stage):
        UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(FORE)).UnbindAllBindings()
        skin = stage.GetPrimAtPath(f"{FORE}/skin")
        plastic = UsdShade.Material(stage.GetPrimAtPath(PLASTIC))
        UsdShade.MaterialBindingAPI.Apply(skin).Bind(plastic, materialPurpose="physics")

    assert material(tmp_path, edit).path == PLASTIC


def test_a_flexible_body_without_a_material_is_refused(tmp_path):
    with pytest.raises(ShotError, match="without an elastic material") as caught:
        material(tmp_path, lambda s: UsdShade.MaterialBindingAPI(s.GetPrimAtPath(FORE)).UnbindAllBindings())
    assert (caught.value.path, caught.value.attribute) == (FORE, "material:binding:physics")
    assert "PhysicsVolumeDeformableMaterialAPI" in caught.value.remedy


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("youngsModulus", 0.0), ("youngsModulus", -1.0), ("youngsModulus", float("inf")),
        ("poissonsRatio", 0.5), ("poissonsRatio", -1.0), ("poissonsRatio", float("nan")),
        ("density", 0.0), ("density", -5.0),
    ],
)  # fmt: skip
def test_values_that_no_solid_has_are_refused(tmp_path, name, value):
    with pytest.raises(ShotError) as caught:
        material(tmp_path, **{name: value})
    assert (caught.value.path, caught.value.attribute) == (PLASTIC, f"physics:{name}")


def test_a_value_that_is_not_authored_is_named(tmp_path):
    with pytest.raises(ShotError, match="not authored") as caught:
        material(tmp_path, lambda stage: stage.GetPrimAtPath(PLASTIC).RemoveProperty("physics:density"))
    assert caught.value.attribute == "physics:density"


@pytest.mark.parametrize(
    ("name", "value"), [("ratio", -0.1), ("ratio", 1.0), ("rayleighMass", -1.0), ("rayleighStiffness", float("nan"))]
)
def test_damping_out_of_range_is_refused(tmp_path, name, value):
    def edit(stage):
        stage.GetPrimAtPath(PLASTIC).CreateAttribute(f"calm:damping:{name}", Sdf.ValueTypeNames.Float).Set(value)

    with pytest.raises(ShotError) as caught:
        material(tmp_path, edit)
    assert caught.value.attribute == f"calm:damping:{name}"
