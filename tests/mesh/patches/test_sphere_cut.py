"""Tetrahedra cut along a sphere: every triangle of their surface is inside or outside, and they fill the same body."""

import numpy as np
import pytest
from calmotion.mesh.patches.sphere_cut import cut, inside
from calmotion.mesh.tetrahedra import boundary_triangles, min_dihedral_deg, surface_area, tet_volumes

SIZE = (0.3, 0.04, 0.04)


@pytest.mark.parametrize(("center", "radius"), [((0.0, 0.02, 0.02), 0.013), ((0.01, 0.02, 0.02), 0.03)])
@pytest.mark.parametrize("counts", [(15, 2, 2), (23, 3, 4)])
def test_the_surface_is_divided_by_the_sphere_and_the_body_is_the_same(helpers, counts, center, radius):
    points, tets = helpers.box(counts, SIZE)
    center = np.array(center)
    found, split = cut(np.asarray(points), tets, center, radius)
    assert tet_volumes(found, split).min() > 0.0 and min_dihedral_deg(found, split) > 2.0
    assert tet_volumes(found, split).sum() == pytest.approx(np.prod(SIZE), rel=1e-12)
    triangles = boundary_triangles(split)
    assert surface_area(found, triangles) == pytest.approx(
        2 * (SIZE[0] * SIZE[1] + SIZE[1] * SIZE[2] + SIZE[2] * SIZE[0]), rel=1e-12
    )
    within = inside(found[triangles], center, radius)
    distance = np.linalg.norm(found[triangles] - center, axis=2)
    edge = np.linalg.norm(np.ptp(found[triangles], axis=1), axis=1)
    assert 0 < within.sum() < len(within)
    assert (distance[~within].min(axis=1) >= radius - 0.1 * edge[~within]).all()


def test_the_rim_on_a_face_is_a_circle(helpers):
    points, tets = helpers.box((12, 5, 5), SIZE)
    center, radius = np.array([0.0, 0.021, 0.019]), 0.015
    found, split = cut(np.asarray(points), tets, center, radius)
    triangles = boundary_triangles(split)
    area = surface_area(found, triangles[inside(found[triangles], center, radius)])
    assert 0.93 * np.pi * radius**2 < area < np.pi * radius**2  # a polygon in the circle


def test_a_sphere_that_meets_no_edge_changes_nothing(helpers):
    points, tets = helpers.box((3, 1, 1), SIZE)
    found, split = cut(np.asarray(points), tets, np.array([1.0, 0.0, 0.0]), 0.1)
    assert np.array_equal(found, points) and np.array_equal(split, tets)


def test_points_that_are_fixed_stay_where_they_are(helpers):
    points, tets = helpers.box((12, 5, 5), SIZE)
    points, center, radius = np.asarray(points), np.array([0.0, 0.021, 0.019]), 0.015
    free, _ = cut(points, tets, center, radius)
    moved = np.flatnonzero((free[: len(points)] != points).any(axis=1))
    assert len(moved) > 3
    fixed = np.zeros(len(points), dtype=bool)
    fixed[moved[::2]] = True
    found, split = cut(points, tets, center, radius, fixed)
    assert np.array_equal(found[: len(points)][fixed], points[fixed]) and not np.array_equal(
        found[: len(points)], points
    )
    assert tet_volumes(found, split).min() > 0.0 and tet_volumes(found, split).sum() == pytest.approx(np.prod(SIZE))
    triangles = boundary_triangles(split)
    area = surface_area(found, triangles[inside(found[triangles], center, radius)])
    assert area == pytest.approx(np.pi * radius**2, rel=0.12)
