"""UsdPhysics' precedence for mass, and its conventions for "not authored"."""

import numpy as np
import pytest
from calmotion.usd.reading import read_shot
from pxr import Gf, UsdGeom, UsdPhysics, UsdShade
from small_shots import BASE, FORE, LENGTH, UPPER, WIDTH, clear_mass, make_flexible, set_float, write_arm

VOLUME = LENGTH * WIDTH**2
CUBE = f"{UPPER}/box"


def body(tmp_path, path: str, edit=None):
    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    return next(b for b in character.bodies if b.path == path), character.notes


def test_authored_values_are_taken_as_they_are(tmp_path):
    mass = body(tmp_path, FORE)[0].mass
    assert mass.mass == pytest.approx(0.5) and np.allclose(mass.center, [0.2, 0, 0])
    assert np.allclose(mass.inertia, np.diag([1e-4, 7e-3, 7e-3]))


def test_principal_axes_rotate_the_inertia(tmp_path):
    def edit(stage):
        turn = Gf.Quatf(float(np.cos(np.pi / 4)), 0, 0, float(np.sin(np.pi / 4)))  # a quarter about z: x to y
        UsdPhysics.MassAPI(stage.GetPrimAtPath(FORE)).CreatePrincipalAxesAttr(turn)

    assert np.allclose(body(tmp_path, FORE, edit)[0].mass.inertia, np.diag([7e-3, 1e-4, 7e-3]), atol=1e-9)


def test_a_density_on_the_collider_gives_mass_centre_and_inertia(tmp_path):
    mass = body(tmp_path, UPPER)[0].mass
    assert mass.mass == pytest.approx(1200.0 * VOLUME, rel=1e-6)
    assert np.allclose(mass.center, [LENGTH / 2, 0, 0], atol=1e-7)
    across = mass.mass / 12 * (LENGTH**2 + WIDTH**2)
    assert np.allclose(np.diag(mass.inertia), [mass.mass * WIDTH**2 / 6, across, across], rtol=1e-6)


def test_a_mass_on_the_body_overrides_those_below_and_scales_the_inertia(tmp_path):
    def edit(stage):
        UsdPhysics.MassAPI.Apply(stage.GetPrimAtPath(UPPER)).CreateMassAttr(3.0)
        set_float(stage, CUBE, "physics:mass", 99.0)

    mass = body(tmp_path, UPPER, edit)[0].mass
    assert mass.mass == pytest.approx(3.0)
    assert mass.inertia[0, 0] == pytest.approx(3.0 * WIDTH**2 / 6, rel=1e-6)


def test_a_mass_of_zero_is_none_as_in_usdphysics(tmp_path):
    def edit(stage):
        UsdPhysics.MassAPI.Apply(stage.GetPrimAtPath(UPPER)).CreateMassAttr(0.0)

    found, notes = body(tmp_path, UPPER, edit)
    assert found.mass.mass == pytest.approx(body(tmp_path, UPPER)[0].mass.mass)
    assert any("physics:mass is 0" in note for note in notes)


def test_the_mass_of_a_collider_overrides_its_density(tmp_path):
    mass = body(tmp_path, UPPER, lambda stage: set_float(stage, CUBE, "physics:mass", 7.0))[0].mass
    assert mass.mass == pytest.approx(7.0)


def test_the_density_of_the_collider_beats_the_bodys_and_that_beats_the_materials(tmp_path):
    def material(stage):
        made = UsdShade.Material.Define(stage, "/Arm/materials/Steel")
        UsdPhysics.MaterialAPI.Apply(made.GetPrim()).CreateDensityAttr(7800.0)
        UsdShade.MaterialBindingAPI.Apply(stage.GetPrimAtPath(CUBE)).Bind(made, materialPurpose="physics")

    def on_body(stage):
        UsdPhysics.MassAPI.Apply(stage.GetPrimAtPath(UPPER)).CreateDensityAttr(500.0)

    def none_on_collider(stage):
        stage.GetPrimAtPath(CUBE).GetAttribute("physics:density").Set(0.0)  # 0 means: not authored

    for edits, density in (
        ([material, on_body], 1200.0),
        ([material, on_body, none_on_collider], 500.0),
        ([material, none_on_collider], 7800.0),
    ):
        mass = body(tmp_path, UPPER, lambda stage, edits=edits: [edit(stage) for edit in edits])[0].mass
        assert mass.mass == pytest.approx(density * VOLUME, rel=1e-6)


def test_a_collider_without_any_density_has_that_of_water_and_a_note(tmp_path):
    found, notes = body(tmp_path, UPPER, lambda stage: stage.GetPrimAtPath(CUBE).RemoveProperty("physics:density"))
    assert found.mass.mass == pytest.approx(1000.0 * VOLUME, rel=1e-6)
    assert any("1000 kg/m^3" in note and CUBE in note for note in notes)


def test_colliders_of_types_without_a_volume_are_named(tmp_path):
    def edit(stage):
        for name, kind in (("ground", "Plane"), ("cloud", "Points")):
            UsdPhysics.CollisionAPI.Apply(stage.DefinePrim(f"{UPPER}/{name}", kind))

    found, notes = body(tmp_path, UPPER, edit)
    assert found.mass.mass == pytest.approx(1200.0 * VOLUME, rel=1e-6)
    assert any(f"{UPPER}/ground" in note and "Plane" in note for note in notes)
    assert any(f"{UPPER}/cloud" in note and "Points" in note for note in notes)


def test_the_centre_of_mass_is_in_the_scaled_axes_of_the_body(tmp_path):
    def edit(stage):
        UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).AddScaleOp().Set(Gf.Vec3f(2, 3, 4))

    assert np.allclose(body(tmp_path, FORE, edit)[0].mass.center, [0.4, 0, 0], atol=1e-7)


def test_unauthored_centre_and_inertia_follow_from_the_geometry(tmp_path):
    def edit(stage):
        api = UsdPhysics.MassAPI(stage.GetPrimAtPath(FORE))
        api.GetCenterOfMassAttr().Set(Gf.Vec3f(-np.inf))
        api.GetDiagonalInertiaAttr().Set(Gf.Vec3f(0))

    mass = body(tmp_path, FORE, edit)[0].mass
    assert np.allclose(mass.center, [LENGTH / 2, 0, 0], atol=1e-7)
    assert mass.inertia[0, 0] == pytest.approx(0.5 * WIDTH**2 / 6, rel=1e-5)


def test_a_mass_without_geometry_or_inertia_is_a_ball_and_a_note(tmp_path):
    def edit(stage):
        stage.GetPrimAtPath(BASE).RemoveProperty("physics:diagonalInertia")

    found, notes = body(tmp_path, BASE, edit)
    assert found.mass.inertia[0, 0] == pytest.approx(0.4 * 2.0 * (3 * 2.0 / (4 * np.pi * 1000.0)) ** (2 / 3))
    assert any("ball" in note for note in notes)


def test_an_open_mesh_takes_the_volume_of_its_hull_and_a_note(tmp_path):
    def edit(stage):
        clear_mass(stage, FORE)
        UsdPhysics.MassAPI(stage.GetPrimAtPath(FORE)).CreateDensityAttr(1000.0)
        UsdGeom.Mesh(stage.GetPrimAtPath(f"{FORE}/skin")).CreateHoleIndicesAttr([0])

    found, notes = body(tmp_path, FORE, edit)
    assert found.mass.mass == pytest.approx(1000.0 * VOLUME, rel=1e-6)
    assert any("convex hull" in note for note in notes)


def test_an_inertia_that_no_body_has_is_noted(tmp_path):
    def edit(stage):
        UsdPhysics.MassAPI(stage.GetPrimAtPath(FORE)).GetDiagonalInertiaAttr().Set(Gf.Vec3f(1, 1, 5))

    assert any("physically impossible" in note for note in body(tmp_path, FORE, edit)[1])


def weight(stage, path, mass=None, density=None):
    api = UsdPhysics.MassAPI.Apply(stage.GetPrimAtPath(path))
    if mass is not None:
        api.CreateMassAttr(mass)
    if density is not None:
        api.CreateDensityAttr(density)


def collider(stage, size=0.1):
    UsdGeom.Cube.Define(stage, f"{FORE}/hull").CreateSizeAttr(size)
    UsdPhysics.CollisionAPI.Apply(stage.GetPrimAtPath(f"{FORE}/hull"))


def dense(stage, path):
    material = UsdShade.Material.Define(stage, "/Arm/materials/Dense")
    UsdPhysics.MaterialAPI.Apply(material.GetPrim()).CreateDensityAttr(500.0)
    UsdShade.MaterialBindingAPI.Apply(stage.GetPrimAtPath(path)).Bind(material, materialPurpose="physics")


STATED = {  # on the skin, a visible bar of 0.64 l, and a collider of 1 l
    "on what is visible": (lambda s: weight(s, f"{FORE}/skin", 0.5), 0.5),
    "density of what is visible": (lambda s: weight(s, f"{FORE}/skin", density=500.0), 0.32),
    "beside a collider that states none": (lambda s: (weight(s, f"{FORE}/skin", 0.5), collider(s)), 0.5),
    "beside a collider that does": (
        lambda s: (weight(s, f"{FORE}/skin", 0.5), collider(s), weight(s, f"{FORE}/hull", 0.3)), 0.3
    ),
    "beside a density of the body": (
        lambda s: (weight(s, f"{FORE}/skin", 0.5), collider(s), weight(s, FORE, density=200.0)), 0.2
    ),
    "of the material of a collider": (lambda s: (collider(s), dense(s, f"{FORE}/hull")), 0.5),
    "of the material of what is visible": (lambda s: dense(s, f"{FORE}/skin"), 0.32),
}  # fmt: skip


@pytest.mark.parametrize("flexible", [False, True], ids=["rigid", "flexible"])
@pytest.mark.parametrize("name", STATED)
def test_a_stated_mass_counts_wherever_it_stands_also_of_a_flexible_body(tmp_path, name, flexible):
    state, mass = STATED[name]

    def edit(stage):
        clear_mass(stage, FORE)
        state(stage)
        if flexible:
            make_flexible(stage)

    assert body(tmp_path, FORE, edit)[0].mass.mass == pytest.approx(mass, rel=1e-6)


def test_masses_where_they_are_not_used_are_told(tmp_path):
    def edit(stage):
        group = UsdGeom.Xform.Define(stage, f"{UPPER}/group").GetPrim()
        UsdPhysics.MassAPI.Apply(group).CreateMassAttr(7.0)
        UsdPhysics.MassAPI(stage.GetPrimAtPath(CUBE)).CreateCenterOfMassAttr(Gf.Vec3f(0.1, 0.0, 0.0))
        UsdPhysics.MassAPI(stage.GetPrimAtPath(CUBE)).CreateDiagonalInertiaAttr(Gf.Vec3f(0.0))  # not authored

    upper, notes = body(tmp_path, UPPER, edit)
    told = [note for note in notes if "is not used here" in note]
    assert [note.split(" is")[0] for note in told] == [f"{CUBE}: physics:centerOfMass", f"{UPPER}/group: physics:mass"]
    assert all(note.endswith(UPPER) for note in told) and upper.mass.mass == pytest.approx(1200.0 * VOLUME, rel=1e-6)


def test_a_mass_without_centre_or_geometry_says_where_its_centre_is(tmp_path):
    def edit(stage):
        stage.RemovePrim(f"{FORE}/skin")
        stage.GetPrimAtPath(FORE).RemoveProperty("physics:centerOfMass")

    fore, notes = body(tmp_path, FORE, edit)
    assert np.allclose(fore.mass.center, 0.0) and np.allclose(fore.mass.inertia, np.diag([1e-4, 7e-3, 7e-3]))
    assert any(note.startswith(FORE) and "its centre is at its origin" in note for note in notes)
