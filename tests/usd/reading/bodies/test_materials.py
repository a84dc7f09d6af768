"""Elastic materials: found, converted, refused."""

from __future__ import annotations

import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from pxr import UsdShade
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


def test_a_value_that_is_not_authored_is_named(tmp_path):
    with pytest.raises(ShotError, match="not authored") as caught:
        material(tmp_path, lambda stage: stage.GetPrimAtPath(PLASTIC).RemoveProperty("physics:density"))
    assert caught.value.attribute == "physics:density"
