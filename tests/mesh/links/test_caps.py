"""Caps of holes of any size."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.sources import caps as caps_module
from calmotion.mesh.surfaces.closed_surfaces import boundary_walks
from calmotion.mesh.tetrahedra import surface_volume


def open_tube(without_rings: bool):
    """A tube of 20 and 30 mm radius, 0.1 m long; without the rings at its ends it is two surfaces."""
    tube = trimesh.creation.annulus(0.02, 0.03, 0.1, sections=24)
    if without_rings:
        tube.update_faces(np.abs(tube.face_normals[:, 2]) < 0.5)
    return np.array(tube.vertices), np.array(tube.faces)


def test_a_ring_between_two_edges_in_one_plane_is_closed_as_a_ring():
    points, triangles = open_tube(without_rings=True)
    closed = caps_module.capped(points, triangles)
    assert boundary_walks(closed.triangles) == []
    whole = open_tube(without_rings=False)
    assert surface_volume(closed.points, closed.triangles) == pytest.approx(surface_volume(*whole), rel=1e-9)
    # the caps are the two rings, of the inscribed polygons
    polygon = 24 * np.sin(2 * np.pi / 24) / 2
    assert closed.areas.sum() == pytest.approx(2 * polygon * (0.03**2 - 0.02**2), rel=1e-9)


def test_a_flat_hole_that_is_not_convex_is_closed_exactly():
    profile = np.array([[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]], dtype=float)
    solid = trimesh.creation.extrude_triangulation(profile, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]), 1.0)
    triangles = np.array(solid.faces)[solid.face_normals[:, 2] < 0.5]
    closed = caps_module.capped(np.array(solid.vertices), triangles)
    assert surface_volume(closed.points, closed.triangles) == pytest.approx(7.0, rel=1e-9)
    assert closed.areas.sum() == pytest.approx(7.0, rel=1e-9)


def test_a_hole_that_is_not_flat_gets_a_fan():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    wavy = np.array(ball.triangles_center)
    kept = wavy[:, 2] < 0.02 + 0.3 * wavy[:, 0]
    closed = caps_module.capped(np.array(ball.vertices), np.array(ball.faces)[kept])
    assert boundary_walks(closed.triangles) == []
    assert 0.5 < surface_volume(closed.points, closed.triangles) / ball.volume < 0.9


def test_a_closed_surface_stays():
    ball = trimesh.creation.icosphere(subdivisions=1)
    closed = caps_module.capped(np.array(ball.vertices), np.array(ball.faces))
    assert np.array_equal(closed.triangles, ball.faces) and len(closed.areas) == 0
