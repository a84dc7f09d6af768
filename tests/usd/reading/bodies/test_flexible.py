"""Settings of flexible bodies."""

import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from pxr import Gf, Sdf, UsdGeom, UsdPhysics, UsdShade
from small_shots import FORE, PLASTIC, Scale, box, make_flexible, set_float, write_arm


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


def fore_part(tmp_path, edit, scale=None):
    scale = scale or Scale()

    def flexible(stage):
        make_flexible(stage, scale=scale)
        edit(stage, scale)

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", flexible, scale)))
    return next(b for b in character.bodies if b.path == FORE).flexible.material, " ".join(character.notes)


@pytest.mark.parametrize("scale", [Scale(), Scale(0.01, 0.001)])
def test_each_mesh_has_the_material_that_is_bound_to_it_in_si(tmp_path, scale):
    found, _ = fore_part(tmp_path, steel, scale)
    assert found.path == PLASTIC and found.youngs_modulus == pytest.approx(2e9, rel=1e-6)
    parts = {part.path: part for part in found.parts}
    assert set(parts) == {f"{FORE}/skin", f"{FORE}/insert"}
    insert, skin = parts[f"{FORE}/insert"], parts[f"{FORE}/skin"]
    assert (insert.material, skin.material) == (STEEL, PLASTIC)
    assert (insert.modulus, insert.density, insert.damping) == pytest.approx((100.0, 7.0, 0.001), rel=1e-5)
    assert (skin.modulus, skin.density, skin.damping) == pytest.approx((1.0, 1.0, 0.01))
    assert insert.points.max() == pytest.approx(0.2) and skin.points.max() == pytest.approx(0.4)


def test_one_poissons_ratio_is_used_and_told(tmp_path):
    found, notes = fore_part(tmp_path, lambda stage, scale: steel(stage, scale, 0.3))
    assert 0.3 < found.poissons_ratio < 0.31  # the insert is 12.5 times as stiff
    assert "Poisson" in notes and "0.3 to 0.4" in notes


def test_one_material_for_all_meshes_makes_no_parts(tmp_path):
    assert fore_part(tmp_path, lambda stage, scale: box(stage, f"{FORE}/insert", scale))[0].parts == ()


def test_a_print_with_parts_of_other_materials_is_refused(tmp_path):
    def printed(stage, scale):
        steel(stage, scale)
        set_float(stage, FORE, "calm:flexible:infill", 0.2)

    with pytest.raises(ShotError, match="meshes have several") as caught:
        fore_part(tmp_path, printed)
    assert (caught.value.path, caught.value.attribute) == (FORE, "calm:flexible:infill")


def printed(infill=None, perimeters=None, wall=None, section=None, scale=None):
    def edit(stage):
        make_flexible(stage, scale=scale or Scale())
        if infill is not None:
            set_float(stage, FORE, "calm:flexible:infill", infill)
        if wall is not None:
            set_float(stage, FORE, "calm:flexible:wallThickness", wall)
        if perimeters is not None:
            stage.GetPrimAtPath(FORE).CreateAttribute("calm:flexible:perimeters", Sdf.ValueTypeNames.Int).Set(
                perimeters
            )
        if section is not None:
            stage.GetPrimAtPath(FORE).CreateAttribute("calm:flexible:section", Sdf.ValueTypeNames.Token).Set(section)

    return edit


def test_infill_makes_a_core_below_a_skin_of_two_lines(tmp_path):
    body, notes = fore(tmp_path, printed(infill=0.2))
    core = body.flexible.material.core
    assert (core.skin, core.infill) == pytest.approx((0.9e-3, 0.2)) and core.stiffness == pytest.approx(0.2 / 2.6)
    assert body.flexible.wall_thickness == -1.0
    assert any("0.9 mm and 20% infill" in note for note in notes)
    assert fore(tmp_path, make_flexible)[0].flexible.material.core is None


def test_perimeters_or_a_wall_tell_the_skin(tmp_path):
    assert fore(tmp_path, printed(infill=0.2, perimeters=4))[0].flexible.material.core.skin == pytest.approx(1.8e-3)
    scale = Scale(meters=0.01)
    body = fore(tmp_path, printed(infill=0.2, wall=0.12, scale=scale), scale)[0]
    assert body.flexible.material.core.skin == pytest.approx(1.2e-3) and body.flexible.wall_thickness == -1.0


def test_no_infill_is_a_hollow_part_and_all_of_it_a_solid_one(tmp_path):
    hollow = fore(tmp_path, printed(infill=0.0, perimeters=3))[0].flexible
    assert hollow.material.core is None and hollow.wall_thickness == pytest.approx(1.35e-3)
    solid = fore(tmp_path, printed(infill=1.0, perimeters=3))[0].flexible
    assert solid.material.core is None and solid.wall_thickness == -1.0


@pytest.mark.parametrize(
    ("given", "attribute", "text"),
    [
        ({"infill": 20.0}, "infill", "0.2 for 20%"),
        ({"infill": -0.5}, "infill", "between 0 and 1"),
        ({"infill": float("nan")}, "infill", "between 0 and 1"),
        ({"infill": 0.2, "perimeters": 0}, "perimeters", "at least 1"),
        ({"perimeters": 3}, "perimeters", "no infill"),
        ({"infill": 0.2, "perimeters": 3, "wall": 0.002}, "perimeters", "Remove one"),
        ({"infill": 0.2, "section": "tube"}, "section", "infill to 0"),
    ],
)
def test_contradictions_are_refused_with_what_to_do(tmp_path, given, attribute, text):
    with pytest.raises(ShotError, match=text) as caught:
        fore(tmp_path, printed(**given))
    assert (caught.value.path, caught.value.attribute) == (FORE, f"calm:flexible:{attribute}")
