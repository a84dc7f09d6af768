"""Slits of wrapped solids are filled where a mesh cannot follow them, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.repair import closing
from calmotion.mesh.sources import slits as slits_module
from calmotion.mesh.surfaces.closed_surfaces import boundary_walks
from calmotion.model import Frame
from calmotion.reduction.mesh_refinement import response
from mesher_links import box, link, run, solid, surface

LENGTH, SIDE = 0.2, 0.02
SIZE = float(np.linalg.norm([LENGTH, SIDE, SIDE]))
THIN, WIDE = 2e-4 * SIZE, 5e-3 * SIZE


def slit_bar(width):
    """A bar with a slit across it in the middle, three quarters of its height deep."""
    bar = box((LENGTH, SIDE, SIDE))
    return bar.difference(box((width, 2 * SIDE, SIDE), at=(0.0, 0.0, SIDE / 4)))


def opened(mesh):
    """Without the face at one end: such a surface is wrapped."""
    made = mesh.copy()
    made.update_faces(made.triangles_center[:, 0] > -0.4999 * LENGTH)
    assert not made.is_watertight
    return made


def filled(mesh):
    """A surface of its own size with filled slits, and the messages."""
    part, repairs = closing.Part, []
    size = float(np.linalg.norm(mesh.extents))
    made = slits_module.without_slits(
        part(np.array(mesh.vertices) / size, np.array(mesh.faces, dtype=np.int64)), size, repairs
    )
    return trimesh.Trimesh(made.points * size, made.triangles, process=False), repairs


def test_a_thin_slit_is_filled_and_the_rest_of_the_surface_stays():
    bar = slit_bar(THIN)
    made, repairs = filled(bar)
    assert bar.volume == pytest.approx(LENGTH * SIDE**2 - 0.75 * THIN * SIDE**2, rel=1e-6)
    beside = 1e-3 * SIZE  # how far a filling stands out of the slit
    assert 0.0 < made.volume - LENGTH * SIDE**2 < 4.0 * SIDE * beside * (THIN + 2e-4 * SIZE)
    assert boundary_walks(np.asarray(made.faces)) == []
    assert repairs == ["filled 1 slit of up to 0.04 mm"]
    away = np.abs(made.vertices[:, 0]) > 2e-3 * SIZE
    corners = np.abs(made.vertices[away]) / [LENGTH / 2, SIDE / 2, SIDE / 2]
    assert corners == pytest.approx(np.ones((8, 3)), abs=1e-6)
    assert made.bounds == pytest.approx(bar.bounds, abs=beside * 1.01)


def test_a_grid_closes_many_wide_slits():
    bar = box((LENGTH, SIDE, SIDE))
    for at in (-0.25 * LENGTH, 0.0, 0.25 * LENGTH):
        bar = bar.difference(box((WIDE, 2 * SIDE, SIDE), at=(at, 0.0, SIDE / 4)))
    made, repairs = filled(bar)
    assert repairs == [
        "closed its slits of up to 1.4 mm on a grid, since 9.7% of its surface has wider ones than are filled: edges "
        "are cut off by up to 0.71 mm"
    ]
    assert boundary_walks(np.asarray(made.faces)) == []
    edge = slits_module._SPACING * SIZE
    assert made.volume == pytest.approx(LENGTH * SIDE**2, abs=0.5 * 4.0 * (LENGTH + 2.0 * SIDE) * edge**2)
    assert np.abs(made.bounds - bar.bounds).max() < edge
    middle = np.abs(made.vertices[:, 0]) < 0.4 * LENGTH
    assert np.abs(made.vertices[middle][:, 1:]).max(axis=1).min() > SIDE / 2 - 2.0 * edge  # no cavity


@pytest.mark.parametrize("width", [WIDE, 2.2e-3 * SIZE])
def test_a_wider_slit_is_kept(width):
    bar = slit_bar(width)
    made, repairs = filled(bar)
    assert made.volume == pytest.approx(bar.volume, rel=1e-12) and repairs == []
    assert np.array_equal(made.faces, bar.faces)


def test_sharp_corners_are_no_slits():
    bar = box((LENGTH, SIDE, SIDE))
    notch = trimesh.creation.box((SIDE / 2, 2 * SIDE, SIDE / 2))
    notch.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 4, (0, 1, 0)))
    notch.apply_translation((0.0, 0.0, SIDE / 2))
    notched = bar.difference(notch)
    made, repairs = filled(notched)
    assert made.volume == pytest.approx(notched.volume, rel=1e-12) and repairs == []


def test_a_slit_that_narrows_to_nothing_is_filled_where_it_is_thin():
    """As between an ear and the wall that it leaves at a small angle."""
    angle = np.radians(4.0)
    corners = np.array([[-0.02, 0.0], [0.2, 0.0], [0.2, 0.22 * np.tan(angle)]])
    flat = [[x, y, z] for y in (-SIDE, SIDE) for x, z in corners]
    wedge = trimesh.Trimesh(flat).convex_hull
    bar = box((LENGTH, SIDE, SIDE)).difference(wedge)
    made, repairs = filled(bar)
    thin = 0.5 * SIDE * (2e-3 * SIZE) ** 2 / np.tan(angle)  # volume of the wedge up to the limit
    assert made.volume - bar.volume == pytest.approx(thin, rel=0.3)
    assert boundary_walks(np.asarray(made.faces)) == [] and repairs[0].startswith("filled 1 slit of up to 0.")


@pytest.mark.parametrize("gap", [1e-12, 1e-4])
def test_a_pin_in_a_hole_is_one_solid_with_it(gap):
    hole = trimesh.creation.cylinder(0.02, 0.05, sections=64)
    ring = box((0.06, 0.06, 0.05)).difference(hole)
    pin = trimesh.creation.cylinder(0.02 - gap, 0.05, sections=64)
    made, _ = filled(trimesh.util.concatenate([ring, pin]))
    assert made.body_count == 1
    assert made.volume == pytest.approx(0.06 * 0.06 * 0.05, rel=1e-4)


def test_a_thin_cavity_is_filled_and_another_one_is_kept():
    thin, thick = box((0.05, 0.01, THIN), at=(0.05, 0.0, 0.0)), box((0.03, 0.01, 0.01), at=(-0.05, 0.0, 0.0))
    for cavity in (thin, thick):
        cavity.invert()
    bar = trimesh.util.concatenate([box((LENGTH, SIDE, SIDE)), thin, thick])
    made, repairs = filled(bar)
    assert made.volume == pytest.approx(LENGTH * SIDE**2 - 3e-6, rel=1e-6)
    assert len(repairs) == 1


def test_a_slit_of_a_closed_visual_surface_is_kept():
    bar = slit_bar(THIN)
    made = solid(surface(bar))
    assert made.volume == pytest.approx(bar.volume, rel=1e-6) and made.repairs == ()


def test_a_wrapped_bar_with_a_thin_slit_has_the_frequencies_of_the_whole_bar(host):
    held = Frame(np.array([-LENGTH / 2, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    found = []
    for bar in (box((LENGTH, SIDE, SIDE)), slit_bar(THIN), slit_bar(WIDE)):
        body = link(surface(opened(bar)))
        (mesh,) = run(host, replace(body, flexible=replace(body.flexible, element_size=0.01)))
        assert mesh.quality.source == "wrapped visual surface"
        found.append(response(mesh, body, [AttachmentFrame("root", held, "interface")], 0, None, 3).compliances ** -0.5)
    assert found[1] == pytest.approx(found[0], rel=0.01)
    assert found[2][0] < 0.8 * found[0][0]
