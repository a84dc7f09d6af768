"""The volume between the boundary of tetrahedra and the surface that they were made for."""

import numpy as np
import pytest
from calmotion.mesh.grids.missing_volume import missing_volume
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import boundary_triangles, surface_volume, tet_volumes
from round_bars import RADIUS, bar_surface, coarse_bar

SIZE = np.array([0.2, 0.02, 0.02])


def box_surface(helpers, size):
    corners, bricks = helpers.box((1, 1, 1), size)
    return np.asarray(corners), boundary_triangles(bricks)


@pytest.mark.parametrize("thicker", [1e-4, -1e-4])
def test_the_layer_between_two_boxes_is_missing_or_too_much(helpers, thicker):
    points, tets = helpers.box((10, 2, 2), SIZE)
    surface, triangles = box_surface(helpers, SIZE + [0.0, 0.0, thicker])
    found = missing_volume(np.asarray(points), tets, NearbyTriangles(surface, triangles, 1e-3))
    assert found.volumes.sum() == pytest.approx(SIZE[0] * SIZE[1] * thicker, rel=1e-9)
    assert (np.sign(found.volumes) == np.sign(thicker)).all()
    assert found.points[:, 2] == pytest.approx(SIZE[2]) and len(np.unique(found.points, axis=0)) == 4 * 2 * 20


def test_what_tetrahedra_leave_out_of_a_round_bar_is_missing(helpers):
    surface, triangles = bar_surface()
    points, tets = coarse_bar(helpers)
    left_out = surface_volume(surface, triangles) - tet_volumes(points, tets).sum()
    found = missing_volume(points, tets, NearbyTriangles(surface, triangles, 0.3 * RADIUS))
    assert found.volumes.sum() == pytest.approx(left_out, rel=0.06)  # chords are longer than the layer is thin
    assert found.volumes.min() > 0.0


def test_nothing_is_missing_of_the_same_box(helpers):
    points, tets = helpers.box((10, 2, 2), SIZE)
    assert missing_volume(np.asarray(points), tets, NearbyTriangles(*box_surface(helpers, SIZE), 1e-3)) is None


def test_what_is_farther_than_the_limit_does_not_count(helpers):
    points, tets = helpers.box((10, 2, 2), SIZE)
    surface, triangles = box_surface(helpers, SIZE + [0.0, 1e-4, 2e-3])
    found = missing_volume(np.asarray(points), tets, NearbyTriangles(surface, triangles, 1e-3))
    assert found.points[:, 1] == pytest.approx(SIZE[1])
    assert found.volumes.sum() == pytest.approx(SIZE[0] * SIZE[2] * 1e-4, rel=0.05)
