"""Surfaces with fewer triangles: closed, of the same volume, and as close as was asked."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.surfaces.closed_surfaces import winding_numbers
from calmotion.mesh.surfaces.decimation import decimated
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import surface_volume

TUBE = trimesh.creation.annulus(r_min=0.017, r_max=0.02, height=0.1, sections=256).subdivide()


def far(points, surface, reach):
    """Distances of points to a surface [m]."""
    return np.linalg.norm(NearbyTriangles(*surface, reach).closest(points) - points, axis=1)


def closed(triangles):
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return (np.unique(ends, axis=0, return_counts=True)[1] == 2).all()


def test_thin_walls_keep_their_thickness():
    made = decimated(TUBE.vertices, TUBE.faces, 300, 1e-3)
    assert len(made[1]) == 300 and closed(made[1])
    assert surface_volume(*made) == pytest.approx(TUBE.volume, rel=0.01)
    assert far(np.asarray(TUBE.triangles_center), made, 2e-3).max() < 2.5e-4  # of walls of 3 mm
    middle = np.array([[0.0185 * np.cos(a), 0.0185 * np.sin(a), 0.01] for a in np.linspace(0.0, 6.0, 50)])
    assert winding_numbers(middle, *made) == pytest.approx(1.0, abs=1e-6)


def test_flat_faces_keep_the_corners_alone():
    box = trimesh.creation.box((0.1, 0.04, 0.02)).subdivide().subdivide().subdivide()
    shift = np.array([3.0, -2.0, 5.0])  # as accurate far from the origin
    points, triangles = decimated(box.vertices + shift, box.faces, 12, 1e-6)
    assert len(points) == 8 and len(triangles) == 12
    assert points - shift == pytest.approx(0.5 * np.array([0.1, 0.04, 0.02]) * np.sign(points - shift), abs=1e-7)


@pytest.mark.parametrize("distance", [1e-4, 5e-4])
def test_the_distance_holds_however_many_triangles_are_left(distance):
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.03)
    points, triangles = decimated(ball.vertices, ball.faces, 4, distance)
    assert 4 < len(triangles) < len(ball.faces) and closed(triangles)
    assert np.abs(np.linalg.norm(points, axis=1) - 0.03).max() < 3.0 * distance
    finer = decimated(ball.vertices, ball.faces, 4, 0.5 * distance)[1]
    assert len(finer) > len(triangles)


def test_solids_that_touch_along_an_edge_stay_closed():
    one = trimesh.creation.box((0.1, 0.1, 0.1)).subdivide().subdivide()
    other = one.copy()
    other.apply_translation((0.1, 0.1, 0.0))
    both = trimesh.util.concatenate([one, other])
    both.merge_vertices()
    points, triangles = decimated(both.vertices, both.faces, 24, 1e-3)
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    repeated = np.unique(ends, axis=0, return_counts=True)[1]
    assert (repeated % 2 == 0).all() and (repeated == 4).sum() == 4
    assert surface_volume(points, triangles) == pytest.approx(2e-3, rel=1e-9)
