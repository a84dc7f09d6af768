"""Meshes are refined until their first frequencies are accurate; given elements are kept, and their error is known."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from calmotion.mesh.tetrahedralize import filling, tetwild
from calmotion.model import FEMesh, Frame, MassProperties, TetGeometry
from calmotion.model.materials.parts import Part
from calmotion.model.materials.printed import core_of
from calmotion.model.meshes import MeshQuality
from calmotion.tolerance.meshes import accurate_mesh, body_mesh
from mesher_links import box, link, run, surface

NO_TETS = np.zeros((0, 4), np.int32)


def test_the_mesh_is_refined_to_the_accuracy_and_is_the_same_from_the_cache(host, own_cache, monkeypatch):
    body = link(surface(box((0.2, 0.02, 0.02))))
    (first,) = run(host, body)
    monkeypatch.setattr(tetwild, "_run", lambda *arguments: pytest.fail("meshed again"))
    (again,) = run(host, body)
    assert np.array_equal(first.tets, again.tets) and first.quality.repairs == again.quality.repairs
    assert 0.0 < first.quality.frequency_error == again.quality.frequency_error <= accurate_mesh.ENOUGH
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


def test_a_mesh_is_refined_as_far_as_its_surface_left_time():
    efforts = [accurate_mesh.effort_after(triangles) for triangles in (12, 2_000, 3_000, 4_500, 50_000)]
    nodes = [effort.poor_nodes for effort in efforts]
    assert nodes[0] == nodes[1] > nodes[2] > nodes[3] == nodes[4] > 30_000
    # by 3.3 ms for each triangle and 0.2 ms for each node
    assert 3.3e-3 * 3_000 + 2e-4 * nodes[2] == pytest.approx(20.0, rel=0.01)
    assert all(effort.kept_nodes < effort.poor_nodes and effort.wanted < effort.poor for effort in efforts)


def test_a_mesh_that_leaves_out_too_much_of_its_surface_is_made_again_closer_to_it(monkeypatch):
    mesher, accuracy = body_mesh, accurate_mesh
    body = link(surface(trimesh.creation.cylinder(0.01, 0.2, sections=24)))
    options = mesher.MeshOptions(cache=False)

    def made(limit, closer=1.0):
        monkeypatch.setattr(accuracy, "_LEFT_OUT", limit)
        chosen = replace(options, envelope_factor=closer)
        return mesher.mesh_body(0, body, chosen, (Frame(np.array([0.0, 0.0, -0.1]), np.array([1.0, 0.0, 0.0, 0.0])),))

    first, closer = made(np.inf), made(np.inf, 0.5)
    assert 0.0 < first.quality.shape_error and len(first.points) != len(closer.points)
    limit = 0.5 * first.quality.shape_error
    again = made(limit)
    assert (
        np.array_equal(again.points, closer.points) and again.quality.frequency_error == closer.quality.frequency_error
    )
    assert np.array_equal(made(2.0 * first.quality.shape_error).points, first.points)

    def late(*arguments):
        if arguments[3].envelope_factor < 1.0:
            raise mesher.ShotError("too late", path=body.path)
        return filled(*arguments)

    filled = accuracy.filled
    monkeypatch.setattr(accuracy, "filled", late)
    kept = made(limit)
    assert np.array_equal(kept.points, first.points) and kept.quality.error == first.quality.error


def test_the_triangles_that_were_meshed_decide_about_it(host, monkeypatch):
    told, effort_after = [], accurate_mesh.effort_after
    monkeypatch.setattr(
        accurate_mesh,
        "effort_after",
        lambda count: told.append(count) or effort_after(count),
    )
    cube, ball = box((0.2, 0.02, 0.02)), trimesh.creation.icosphere(subdivisions=3, radius=0.03)
    for _ in range(2):  # the second time from the cache
        for shape in (cube, ball):
            run(host, link(surface(shape)))
    assert told[0] == len(cube.faces) < 100 < told[1] <= len(ball.faces) and told[2:] == told[:2]


def test_an_error_that_remains_is_reported():
    remark, enough = accurate_mesh.remark, accurate_mesh.ENOUGH
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
    note, wound = (
        accurate_mesh.volume_note,
        filling.INTERSECTS,
    )
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
