"""What a joint holds of a body when nobody says."""

import numpy as np
import pytest
from calmotion.mesh.patches.automatic_patch import automatic_radius, end_face
from calmotion.mesh.patches.interface_patches import AttachmentFrame, interface_patches
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.mesh.surfaces.distances import closest_on_triangles


def look(mesh, center, room=np.inf):
    center = np.asarray(center, dtype=float)
    triangles = mesh.nodes[mesh.surface[:, :3]]
    closest = closest_on_triangles(center, triangles)
    gaps = np.linalg.norm(closest - center, axis=1)
    face = end_face(mesh, center, triangles, closest, gaps, room)
    return face, automatic_radius(center, triangles, closest, gaps, room)


@pytest.fixture(scope="module")
def beam(helpers):
    return quadratic_mesh(*helpers.box((20, 2, 2), (0.6, 0.02, 0.02), origin=(0, -0.01, -0.01)))


def test_the_patch_is_the_whole_end_face_of_a_beam_without_its_sides(beam):
    face, _ = look(beam, (0.6, 0.0, 0.0))
    assert np.array_equal(np.sort(face), np.flatnonzero(beam.nodes[:, 0] > 0.6 - 1e-9))


def test_the_side_of_a_beam_is_no_end_and_the_radius_is_its_half_width(beam):
    face, radius = look(beam, (0.3, 0.0, 0.01))
    assert len(face) == 0
    assert radius == pytest.approx(0.01, rel=0.05)


def test_on_a_plate_the_radius_is_about_its_thickness(helpers):
    plate = quadratic_mesh(*helpers.box((8, 8, 1), (0.4, 0.4, 0.01), origin=(-0.2, -0.2, 0.0)))
    face, radius = look(plate, (0.0, 0.0, 0.01))
    assert len(face) == 0
    assert 0.005 <= radius <= 0.02


def test_an_anchor_in_a_bore_finds_the_wall_on_every_mesh(helpers):
    """A square ring: where a ray just misses an edge, what the other places say decides."""
    for cells in (8, 10, 12):
        points, tets = helpers.box((cells, cells, 2), (0.1, 0.1, 0.02), origin=(-0.05, -0.05, 0.0))
        center = points[tets].mean(axis=1)
        tets = tets[np.abs(center[:, :2]).max(axis=1) > 0.025]
        used = np.unique(tets)
        ring = quadratic_mesh(points[used], np.searchsorted(used, tets).astype(np.int32))
        _, radius = look(ring, (0.0005, 0.0003, 0.01))
        assert 0.02 < radius < 0.05


def test_an_anchor_in_the_opening_of_a_tube_takes_its_whole_end(helpers):
    points, tets = helpers.box((20, 4, 4), (0.4, 0.04, 0.04), origin=(0, -0.02, -0.02))
    tets = tets[np.abs(points[tets].mean(axis=1)[:, 1:]).max(axis=1) > 0.01]
    used = np.unique(tets)
    tube = quadratic_mesh(points[used], np.searchsorted(used, tets).astype(np.int32))
    (patch,) = interface_patches(tube, [AttachmentFrame("/j", helpers.frame(0.0, 0.0, 0.0), "interface")], -1.0, "/b")
    at_the_end = np.flatnonzero(np.abs(tube.nodes[:, 0]) < 1e-12)
    assert np.array_equal(patch.nodes, at_the_end) and len(at_the_end) > 50
    # inside of the tube it is the wall around the frame
    (inner,) = interface_patches(tube, [AttachmentFrame("/j", helpers.frame(0.1, 0.0, 0.0), "interface")], -1.0, "/b")
    assert np.abs(tube.nodes[inner.nodes, 0] - 0.1).max() < 0.06 and len(inner.nodes) > 6


def test_the_ground_of_a_recess_is_no_end_face(helpers):
    """Of a block that is 100 mm wide, a hole of 6 mm in the middle of its end, 1 mm deep, has a flat ground."""
    side = np.array([-50.0, -20.0, -3.0, 3.0, 20.0, 50.0]) * 1e-3
    along = np.array([0.0, 0.08, 0.16, 0.239, 0.24])
    points, tets = helpers.box((5, 5, 4), (1.0, 1.0, 1.0))
    x, y, z = np.rint(points * [5, 5, 4]).astype(int).T
    points = np.column_stack([side[x], side[y], along[z]])
    middle = points[tets].mean(axis=1)
    block = quadratic_mesh(points, tets[(np.abs(middle[:, :2]).max(axis=1) > 3e-3) | (middle[:, 2] < 0.239)])
    face, radius = look(block, (0.0, 0.0, 0.239))
    assert len(face) == 0
    assert 0.02 < radius < 0.08


def test_a_joint_on_the_side_of_a_thin_pin_holds_more_than_a_point(helpers):
    """A bar of 150 mm, as wide as 30 mm, with a pin of 1 mm at its end: on the pin alone it would turn as on a ball."""
    side = np.array([-15.0, -0.5, 0.5, 15.0]) * 1e-3
    points, tets = helpers.box((3, 3, 2), (1.0, 1.0, 1.0))
    x, y, z = np.rint(points * [3, 3, 2]).astype(int).T
    points = np.column_stack([side[x], side[y], np.array([0.0, 0.145, 0.15])[z]])
    middle = points[tets].mean(axis=1)
    bar = quadratic_mesh(points, tets[(np.abs(middle[:, :2]).max(axis=1) < 0.5e-3) | (middle[:, 2] < 0.145)])
    _, radius = look(bar, (0.5e-3, 0.0, 0.148))
    assert 0.002 < radius < 0.01
