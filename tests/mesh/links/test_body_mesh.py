"""Which of a body's surfaces count, and whether the tetrahedra fill them."""

import re
from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.sources import choice
from calmotion.mesh.tetrahedralize import filling
from calmotion.mesh.tetrahedralize import tetwild as tetwild_module
from calmotion.model import Frame, MassProperties
from calmotion.tolerance.meshes import body_mesh
from mesher_links import box, link, mesh_body, run, solid, surface


def without_lid():
    """A box without its upper face."""
    open_box = box()
    open_box.update_faces(open_box.face_normals[:, 2] < 0.5)
    return open_box


def test_a_body_without_geometry_is_refused(host):
    with pytest.raises(ShotError, match="no geometry") as caught:
        run(host, link())
    assert caught.value.path == "/Arm/link" and caught.value.remedy


def test_an_open_mesh_is_capped_and_told_by_its_own_path(host):
    lidless = without_lid()
    (mesh,) = run(host, link(surface(lidless, "/Arm/link/shell"), element_size=0.015))
    assert mesh.quality.volume == pytest.approx(8e-5, rel=1e-2)
    first = mesh.quality.repairs[0]
    assert "wrapped visual surface" in first and "/Arm/link/shell" in first and "open surface" in first


def test_hidden_geometry_stands_in_only_for_what_cannot_be_closed_or_when_it_is_asked_for():
    lidless = without_lid()
    hull = surface(box((0.2, 0.03, 0.03)), "/Arm/link/collision", visible=False)
    solid_of = choice.solid_of
    body = link(surface(lidless, "/Arm/link/shell"), hull)
    assert solid_of(body, body.surfaces).volume == pytest.approx(8e-5)
    sheet = box()
    sheet.update_faces(sheet.face_normals[:, 2] > 0.5)
    body = link(surface(sheet, "/Arm/link/sheet"), hull)
    made = solid_of(body, body.surfaces)
    assert made.volume == pytest.approx(1.8e-4) and made.source == "collision surface"
    assert "/Arm/link/sheet" in made.repairs[0] and "volume" in made.repairs[0]
    asked = link(surface(box()), hull, geometry="collision")
    assert solid_of(asked, asked.surfaces).volume == pytest.approx(1.8e-4)
    with pytest.raises(ShotError, match="open surface"):
        solid_of(body := link(surface(sheet), hull, geometry="visual"), body.surfaces)


def test_collision_geometry_of_other_units_is_not_taken():
    tiny = surface(box((1e-4, 1e-4, 1e-4)), "/Arm/link/collision", visible=False)
    body = link(surface(box((0.2, 0.02, 0.02)), "/a"), tiny)
    assert choice.solid_of(body, body.surfaces).volume == pytest.approx(8e-5)
    flat = box()
    flat.update_faces(flat.face_normals[:, 2] > 0.5)
    two = (surface(flat, "/a"), surface(flat.copy().apply_translation((0.0, 0.0, 0.1)), "/b"))
    with pytest.raises(ShotError, match="open surface"):
        choice.solid_of(body := link(*two, tiny), body.surfaces)


def test_copies_count_once_and_hidden_geometry_not_at_all():
    shown = surface(box(), "/a")
    made = solid(shown, surface(box(), "/b"))
    assert made.volume == pytest.approx(8e-5) and made.repairs == ("ignored /b, a copy of /a",)
    body = link(shown, surface(box((1.0, 1.0, 1.0)), "/c", visible=False))
    assert choice.solid_of(body, body.surfaces).volume == pytest.approx(8e-5)


def test_tetrahedra_that_do_not_fill_the_surface_are_refused(host, monkeypatch):
    small = box((0.19, 0.019, 0.019))
    corners = np.array(small.vertices)
    tets = np.array([[0, 1, 2, 4], [3, 1, 7, 2], [5, 1, 4, 7], [6, 2, 7, 4], [1, 2, 4, 7]], dtype=np.int32)
    calls = []

    def shrunken(points, triangles, size, *rest):
        calls.append(size)
        return corners, tets

    monkeypatch.setattr(filling, "tetrahedralize", shrunken)
    with pytest.raises(ShotError, match="do not fill"):
        run(host, link(surface(box())))
    assert len(calls) == 2 and calls == sorted(calls, reverse=True)


@pytest.mark.parametrize("size", [1e-4, 1e-9])
def test_elements_that_are_too_many_for_the_limit_are_refused_before_the_mesher_runs(host, monkeypatch, size):
    monkeypatch.setattr(filling, "tetrahedralize", lambda *arguments: pytest.fail("meshed"))
    with pytest.raises(ShotError, match="too many") as caught:
        run(host, link(surface(box()), element_size=size))
    assert (caught.value.path, caught.value.attribute) == ("/Arm/link", "calm:flexible:elementSize")
    least = float(re.search(r"at least ([0-9.e-]+) m", caught.value.remedy).group(1))
    monkeypatch.undo()
    shape = body_mesh.shape_of(np.array(box().vertices), np.array(box().faces))
    assert filling.expected_nodes(shape, 1.1 * least) * tetwild_module._SECONDS < tetwild_module.TIME_LIMIT


def test_a_visual_surface_that_takes_too_long_gives_way_to_the_collision_surface_or_a_beam(monkeypatch):
    made, tetwild = body_mesh, tetwild_module
    fill, shown = made.filled, surface(box(), "/Arm/link/shown")
    hull = surface(box((0.2, 0.03, 0.02)), "/Arm/link/hull", visible=False)

    def late(index, body, solid, *rest):
        if solid.source == "visual surface":
            raise tetwild.OutOfTime("took too long", path=body.path, found="9 triangles, 60 s")
        return fill(index, body, solid, *rest)

    monkeypatch.setattr(made, "filled", late)
    options, frames = made.MeshOptions(element_size=0.03), (Frame(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])),)
    mesh = mesh_body(link(shown, hull), options, frames)
    assert mesh.quality.source == "collision surface" and mesh.quality.volume == pytest.approx(1.2e-4, rel=1e-2)
    (note,) = [note for note in mesh.quality.repairs if "too long" in note]
    assert "1.5 of the volume of the visual surface" in note and "9 triangles" in note
    mass = MassProperties(0.1, np.array([0.1, 0.0, 0.0]), np.diag([1e-6, 1e-4, 1e-4]))
    beam = mesh_body(replace(link(shown), mass=mass), options, frames)
    assert beam.quality.source == "equivalent beam"
    at_its_end = (Frame(np.array([-0.1, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0])),)
    beam = mesh_body(link(shown), options, at_its_end)  # without a stated mass: that of the surface
    assert beam.quality.source == "equivalent beam"
    assert beam.quality.volume == pytest.approx(box().volume, rel=1e-3)
    assert np.ptp(beam.points, axis=0) == pytest.approx([0.2, 0.02, 0.02], rel=1e-3)
    with pytest.raises(tetwild.OutOfTime):  # nothing else is there, or the shot asks for this surface
        mesh_body(link(shown), options, frames)
    with pytest.raises(tetwild.OutOfTime):
        mesh_body(link(shown, hull, geometry="visual"), options, frames)


def test_the_error_of_a_hull_in_place_of_the_visual_surface_is_that_of_its_stiffness(monkeypatch):
    """A hull half as thick again bends 1.5 times as fast; its modulus makes up for it, and later estimates of the mesh
    keep the error of that."""
    made, fill = body_mesh, body_mesh.filled

    def late(index, body, solid, *rest):
        if solid.source == "visual surface":
            raise tetwild_module.OutOfTime("took too long", path=body.path, found="9 triangles, 60 s")
        return fill(index, body, solid, *rest)

    monkeypatch.setattr(made, "filled", late)
    body = link(surface(box(), "/shown"), surface(box((0.2, 0.03, 0.03)), "/hull", visible=False))
    frame = Frame(np.array([-0.1, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    held = [AttachmentFrame("root", frame, "interface")]
    mesh = mesh_body(body, made.MeshOptions(element_size=0.03), (frame,), held)
    assert 0.8 < mesh.quality.frequency_error < 1.3
    assert mesh.quality.factor_of_source == pytest.approx(1.5**-2, rel=0.15)
    assert any("its modulus is 0.4" in note for note in mesh.quality.repairs)
    assert made.judged(mesh, body, frame, held).quality.deflection_error > 1.0
