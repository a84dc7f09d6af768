"""Meshes are refined until their first frequencies are accurate; given elements are kept, and their error is known."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.mesh.tetrahedralize import filling, tetwild
from calmotion.model import FEMesh, MassProperties, TetGeometry
from calmotion.model.meshes import MeshQuality, Part, core_of
from calmotion.tolerance.meshes import accurate_mesh, body_mesh
from mesher_links import box, link, run, surface

NO_TETS = np.zeros((0, 4), np.int32)


def test_the_mesh_is_refined_to_the_accuracy_and_is_the_same_from_the_cache(host, own_cache, monkeypatch):
    body = link(surface(box((0.2, 0.02, 0.02))))
    (first,) = run(host, body)
    monkeypatch.setattr(tetwild, "_run", lambda *arguments: pytest.fail("meshed again"))
    (again,) = run(host, body)
    assert np.array_equal(first.tets, again.tets) and first.quality.repairs == again.quality.repairs
    assert 0.0 < first.quality.frequency_error == again.quality.frequency_error <= accurate_mesh.GOAL
    assert not first.given


def test_given_elements_are_kept_and_their_error_is_known(host, monkeypatch):
    meshes = [run(host, link(surface(box((0.2, 0.02, 0.02))), element_size=size))[0] for size in (0.05, 0.01)]
    assert all(mesh.given for mesh in meshes)
    assert meshes[0].quality.frequency_error > 2.0 * meshes[1].quality.frequency_error > 0.0
    tets = TetGeometry(points=meshes[0].points, tets=meshes[0].tets, path="/Arm/link/Tets")
    (authored,) = run(host, replace(link(surface(box())), tets=tets))
    assert authored.given and len(authored.tets) == len(meshes[0].tets)
    assert authored.quality.frequency_error == pytest.approx(meshes[0].quality.frequency_error, rel=0.3)
    monkeypatch.setattr(body_mesh, "MAX_NODES", 10)  # an estimate would take too long
    (large,) = run(host, replace(link(surface(box())), tets=tets))
    assert large.given and large.quality.frequency_error is None


def test_an_error_that_remains_is_reported():
    remark, enough = accurate_mesh.remark, accurate_mesh.GOAL
    quality = MeshQuality(20.0, 1.0, 0.0)
    assert remark(quality) == () == remark(replace(quality, frequency_error=enough))
    assert "3%, more than 1%" in remark(replace(quality, frequency_error=0.03))[0]


def test_a_stated_mass_that_the_material_does_not_give_is_reported():
    mass_note = accurate_mesh.mass_note
    stated = MassProperties(0.5 * 1200.0 * 8e-5, np.zeros(3), np.eye(3))
    mesh, small = (FEMesh(0, np.zeros((4, 3)), NO_TETS, MeshQuality(20.0, volume, 0.0)) for volume in (8e-5, 4e-5))
    (note,) = mass_note(replace(link(), mass=stated), mesh)
    assert "0.5 times" in note and "600 instead of 1200 kg/m^3" in note and "wallThickness" in note
    assert mass_note(replace(link(), mass=stated), small) == ()
    assert mass_note(link(), mesh) == ()


def test_a_volume_that_is_not_that_of_the_surface_is_reported_unless_it_winds_around_more():
    note, wound = (accurate_mesh.volume_note, filling.INTERSECTS)
    (text,) = note(MeshQuality(20.0, 8e-5, 0.021))
    assert text == "its volume differs from that of the surface by 2.1%"
    assert note(MeshQuality(20.0, 8e-5, 0.0005)) == note(MeshQuality(20.0, 8e-5, 0.021, (wound,))) == ()


def test_a_print_is_described_and_a_mass_that_is_not_its_own_is_reported(helpers):
    points, tets = helpers.box((16, 2, 2), (0.2, 0.02, 0.02))
    mesh = FEMesh(0, np.asarray(points), tets, MeshQuality(20.0, 8e-5, 0.0))
    body = link()
    note = accurate_mesh.makeup_note
    assert note(body, mesh) == ()
    material = replace(body.flexible.material, core=core_of(0.2, 0.9e-3))
    body = replace(body, flexible=replace(body.flexible, material=material))
    inner = (0.2 - 1.8e-3) * (0.02 - 1.8e-3) ** 2
    mass = 1200.0 * (8e-5 - 0.8 * inner)
    (text,) = note(body, mesh)
    assert "0.9 mm around 20% infill with 7.7% of the modulus" in text and f"{mass:.2g}"[:4] in text
    assert "states" not in text
    heavy = replace(body, mass=MassProperties(2.0 * mass, np.zeros(3), np.eye(3)))
    assert "densities are 2" in note(heavy, mesh)[0] or "densities are 1.9" in note(heavy, mesh)[0]
    assert accurate_mesh.mass_note(heavy, mesh) == ()


def test_parts_are_described_by_material_and_share_and_have_the_mass_of_each(helpers):
    points, tets = helpers.box((8, 2, 2), (0.2, 0.02, 0.02))
    mesh = FEMesh(0, np.asarray(points), tets, MeshQuality(20.0, 8e-5, 0.0))

    def part(name, low, high, density):
        made = box((high - low, 0.02, 0.02), at=(0.5 * (low + high), 0.01, 0.01))
        faces = np.asarray(made.faces, np.int32)
        return Part(f"/Arm/link/{name}", f"/Looks/{name}", np.asarray(made.vertices), faces, 1.0, density, 0.01)

    body = link()
    parts = (part("Steel", 0.0, 0.05, 6.0), part("Nylon", 0.05, 0.2, 1.0))
    material = replace(body.flexible.material, parts=parts)
    body = replace(body, flexible=replace(body.flexible, material=material))
    note = accurate_mesh.makeup_note
    (text,) = note(body, mesh)
    assert "2 parts of 2 materials" in text and "25% /Looks/Steel" in text and "75% /Looks/Nylon" in text
    mass = 1200.0 * 8e-5 * (0.25 * 6.0 + 0.75)
    heavy = replace(body, mass=MassProperties(2.0 * mass, np.zeros(3), np.eye(3)))
    assert "densities are 2 times" in note(heavy, mesh)[0] and accurate_mesh.mass_note(heavy, mesh) == ()
