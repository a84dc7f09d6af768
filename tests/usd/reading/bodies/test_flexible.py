"""Settings of flexible bodies."""

from __future__ import annotations

import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from pxr import Gf, Sdf, UsdGeom, UsdPhysics
from small_shots import FORE, Scale, make_flexible, set_float, write_arm


def fore(tmp_path, edit, scale=None):
    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit, scale)))
    return next(b for b in character.bodies if b.path == FORE), character.notes


def test_fallbacks_mean_automatic(tmp_path):
    settings = fore(tmp_path, make_flexible)[0].flexible
    assert (settings.mode_count, settings.max_frequency, settings.element_size) == (-1, -1.0, -1.0)
    assert (settings.interface_radius, settings.mesh_file, settings.elasticity) == (-1.0, "", "auto")


def test_lengths_become_metres(tmp_path):
    scale = Scale(0.01, 0.001)

    def edit(stage):
        make_flexible(stage, scale=scale)
        set_float(stage, FORE, "calm:flexible:elementSize", 2.0)
        set_float(stage, FORE, "calm:flexible:interfaceRadius", 3.0)
        set_float(stage, FORE, "calm:flexible:maxFrequency", 80.0)
        stage.GetPrimAtPath(FORE).CreateAttribute("calm:flexible:modeCount", Sdf.ValueTypeNames.Int).Set(7)

    settings = fore(tmp_path, edit, scale)[0].flexible
    assert settings.element_size == pytest.approx(0.02) and settings.interface_radius == pytest.approx(0.03)
    assert settings.max_frequency == 80.0 and settings.mode_count == 7


def test_a_body_that_is_switched_off_or_lacks_the_schema_is_rigid(tmp_path):
    def off(stage):
        make_flexible(stage)
        stage.GetPrimAtPath(FORE).CreateAttribute("calm:flexible:enabled", Sdf.ValueTypeNames.Bool).Set(False)

    assert fore(tmp_path, off)[0].flexible is None
    body, notes = fore(tmp_path, lambda stage: set_float(stage, FORE, "calm:flexible:elementSize", 1.0))
    assert body.flexible is None and any("CalmFlexibleBodyAPI" in note for note in notes)


def test_the_mass_of_a_flexible_body_is_left_to_its_density(tmp_path):
    def edit(stage):
        make_flexible(stage)
        stage.GetPrimAtPath(FORE).RemoveProperty("physics:mass")

    assert fore(tmp_path, edit)[0].mass is None
    assert fore(tmp_path, make_flexible)[0].mass.mass == pytest.approx(0.5)


@pytest.mark.parametrize(("name", "value", "mass"), [("physics:mass", 0.7, 0.7), ("physics:density", 2700.0, 1.728)])
def test_a_mass_or_density_stated_on_a_collider_is_believed_of_a_flexible_body_too(tmp_path, name, value, mass):
    def edit(stage):
        make_flexible(stage)
        stage.GetPrimAtPath(FORE).RemoveProperty("physics:mass")
        box = UsdGeom.Cube.Define(stage, f"{FORE}/collider")
        UsdGeom.XformCommonAPI(box).SetScale(Gf.Vec3f(0.4, 0.04, 0.04))
        box.CreateSizeAttr(1.0)
        UsdPhysics.CollisionAPI.Apply(box.GetPrim())
        UsdPhysics.MassAPI.Apply(box.GetPrim())
        set_float(stage, f"{FORE}/collider", name, value)

    assert fore(tmp_path, edit)[0].mass.mass == pytest.approx(mass, rel=1e-5)


def test_a_site_of_mujoco_is_no_geometry(tmp_path):
    def edit(stage):
        make_flexible(stage)
        UsdGeom.Cube.Define(stage, f"{FORE}/site").GetPrim().AddAppliedSchema("MjcSiteAPI")

    body = fore(tmp_path, edit)[0]
    assert body.surfaces and not any(surface.path.endswith("site") for surface in body.surfaces)


def test_a_mesh_file_is_found_beside_the_layer_that_names_it(tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "link.msh").write_text("mesh")

    def edit(stage):
        make_flexible(stage)
        asset = stage.GetPrimAtPath(FORE).CreateAttribute("calm:flexible:meshFile", Sdf.ValueTypeNames.Asset)
        asset.Set(Sdf.AssetPath("./meshes/link.msh"))
        UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).AddScaleOp().Set(Gf.Vec3f(2, 2, 2))

    settings = fore(tmp_path, edit)[0]
    assert settings.flexible.mesh_file == str(tmp_path / "meshes" / "link.msh")
    assert settings.flexible.mesh_scale == pytest.approx(2.0)


def test_the_source_of_the_geometry_is_read_and_a_wrong_one_refused(tmp_path):
    def asks(source):
        def edit(stage):
            make_flexible(stage)
            stage.GetPrimAtPath(FORE).CreateAttribute("calm:flexible:geometry", Sdf.ValueTypeNames.Token).Set(source)

        return edit

    assert fore(tmp_path, make_flexible)[0].flexible.geometry == "auto"
    assert fore(tmp_path, asks("collision"))[0].flexible.geometry == "collision"
    with pytest.raises(ShotError, match="source of geometry") as caught:
        fore(tmp_path, asks("colision"))
    assert caught.value.attribute == "calm:flexible:geometry" and "collision" in caught.value.remedy


def test_the_wall_of_a_hollow_part_is_a_length_of_the_stage(tmp_path):
    scale = Scale(meters=0.01)

    def edit(stage):
        make_flexible(stage, scale=scale)
        set_float(stage, FORE, "calm:flexible:wallThickness", 0.3)
        stage.GetPrimAtPath(FORE).CreateAttribute("calm:flexible:section", Sdf.ValueTypeNames.Token).Set("tube")

    settings = fore(tmp_path, edit, scale)[0].flexible
    assert settings.wall_thickness == pytest.approx(0.003) and settings.section == "tube"
    plain = fore(tmp_path, make_flexible)[0].flexible
    assert plain.wall_thickness == -1.0 and plain.section == "auto"
