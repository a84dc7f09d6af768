"""Meshes of one flexible body with materials of their own."""

from __future__ import annotations

import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from pxr import Sdf, UsdGeom, UsdShade
from small_shots import FORE, PLASTIC, Scale, box, make_flexible, set_float, write_arm

STEEL = "/Arm/materials/Steel"


def steel(stage, scale, ratio=0.4):
    """A steel insert in the forearm, 20 mm wide, with damping of 0.1%."""
    made = UsdShade.Material.Define(stage, STEEL)
    prim = made.GetPrim()
    for api in ("PhysicsVolumeDeformableMaterialAPI", "CalmDampingAPI"):
        prim.AddAppliedSchema(api)
    for name, value in {
        "physics:youngsModulus": 2e11 * scale.meters / scale.kilograms,
        "physics:poissonsRatio": ratio,
        "physics:density": 7700.0 * scale.meters**3 / scale.kilograms,
        "calm:damping:ratio": 0.001,
    }.items():
        prim.CreateAttribute(name, Sdf.ValueTypeNames.Float).Set(value)
    insert = box(stage, f"{FORE}/insert", scale)
    UsdGeom.Xformable(insert).AddScaleOp().Set((0.5, 0.5, 0.5))
    UsdShade.MaterialBindingAPI.Apply(insert.GetPrim()).Bind(made, materialPurpose="physics")


def fore(tmp_path, edit, scale=None):
    scale = scale or Scale()

    def flexible(stage):
        make_flexible(stage, scale=scale)
        edit(stage, scale)

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", flexible, scale)))
    return next(b for b in character.bodies if b.path == FORE).flexible.material, " ".join(character.notes)


@pytest.mark.parametrize("scale", [Scale(), Scale(0.01, 0.001)])
def test_each_mesh_has_the_material_that_is_bound_to_it_in_si(tmp_path, scale):
    found, _ = fore(tmp_path, steel, scale)
    assert found.path == PLASTIC and found.youngs_modulus == pytest.approx(2e9, rel=1e-6)
    parts = {part.path: part for part in found.parts}
    assert set(parts) == {f"{FORE}/skin", f"{FORE}/insert"}
    insert, skin = parts[f"{FORE}/insert"], parts[f"{FORE}/skin"]
    assert (insert.material, skin.material) == (STEEL, PLASTIC)
    assert (insert.modulus, insert.density, insert.damping) == pytest.approx((100.0, 7.0, 0.001), rel=1e-5)
    assert (skin.modulus, skin.density, skin.damping) == pytest.approx((1.0, 1.0, 0.01))
    assert insert.points.max() == pytest.approx(0.2) and skin.points.max() == pytest.approx(0.4)


def test_one_poissons_ratio_is_used_and_told(tmp_path):
    found, notes = fore(tmp_path, lambda stage, scale: steel(stage, scale, 0.3))
    assert 0.3 < found.poissons_ratio < 0.31  # the insert is 12.5 times as stiff
    assert "Poisson" in notes and "0.3 to 0.4" in notes


def test_one_material_for_all_meshes_makes_no_parts(tmp_path):
    def same(stage, scale):
        box(stage, f"{FORE}/insert", scale)

    assert fore(tmp_path, same)[0].parts == ()


def test_a_print_with_parts_of_other_materials_is_refused(tmp_path):
    def printed(stage, scale):
        steel(stage, scale)
        set_float(stage, FORE, "calm:flexible:infill", 0.2)

    with pytest.raises(ShotError, match="meshes have several") as caught:
        fore(tmp_path, printed)
    assert (caught.value.path, caught.value.attribute) == (FORE, "calm:flexible:infill")
