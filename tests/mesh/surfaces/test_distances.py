"""Closest points and rays."""

import numpy as np
import pytest
from calmotion.mesh.surfaces.distances import closest_on_triangles, meets_plane, ray_length
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles

TRIANGLE = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])


@pytest.mark.parametrize(
    ("point", "closest"),
    [
        ((0.2, 0.2, 3.0), (0.2, 0.2, 0.0)),  # above the inside
        ((0.5, -2.0, 1.0), (0.5, 0.0, 0.0)),  # beside an edge
        ((1.0, 1.0, 0.0), (0.5, 0.5, 0.0)),  # beside the long edge
        ((-1.0, -1.0, 5.0), (0.0, 0.0, 0.0)),  # beyond a corner
    ],
)
def test_the_closest_point_of_a_triangle(point, closest):
    assert np.allclose(closest_on_triangles(np.array(point), TRIANGLE)[0], closest, atol=1e-15)


def test_a_ray_finds_the_first_triangle_beyond_what_is_skipped():
    stack = np.concatenate([TRIANGLE + [0, 0, z] for z in (1.0, 3.0)])
    origin, up = np.array([0.2, 0.2, 0.0]), np.array([0.0, 0, 1])
    assert ray_length(origin, up, stack, 0.0) == pytest.approx(1.0)
    assert ray_length(origin, up, stack, 1.5) == pytest.approx(3.0)
    assert ray_length(origin, -up, stack, 0.0) == np.inf
    assert ray_length(np.array([0.7, 0.7, 0.0]), up, stack, 0.0) == np.inf


def test_rays_intersect_as_linear_equations_say():
    rng = np.random.default_rng(4)
    triangles, origins, directions = rng.normal(size=(60, 3, 3)), rng.normal(size=(100, 3)), rng.normal(size=(100, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    # origin + t direction = a + u (b - a) + v (c - a)
    A = np.zeros((100, 60, 3, 3))
    A[..., 0], A[..., 1:] = -directions[:, None], np.swapaxes(triangles[:, 1:] - triangles[:, :1], 1, 2)
    t, u, v = np.moveaxis(np.linalg.solve(A, (origins[:, None] - triangles[:, 0])[..., None])[..., 0], -1, 0)
    expected = np.where((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.1), t, np.inf).min(axis=1)
    assert 10 < np.isfinite(expected).sum() < 95
    found = [ray_length(o, d, triangles, 0.1) for o, d in zip(origins, directions, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_plane_meets_triangles_with_corners_on_both_sides_or_on_it():
    rng = np.random.default_rng(3)
    triangles, origin, normal = rng.standard_normal((200, 3, 3)), rng.standard_normal(3), rng.standard_normal(3)
    height = (triangles - origin) @ normal
    assert np.array_equal(meets_plane(triangles, origin, normal), (height.min(axis=1) <= 0) & (height.max(axis=1) >= 0))
    assert meets_plane(TRIANGLE, np.zeros(3), np.array([1.0, 0.0, 0.0])).all()


@pytest.mark.parametrize("scale", [1e-3, 1.0])
def test_closest_points_are_those_of_all_triangles(scale):
    rng = np.random.default_rng(3)
    points = scale * rng.normal(size=(60, 3))
    triangles = rng.integers(0, len(points), size=(200, 3))
    triangles = triangles[(triangles[:, 0] != triangles[:, 1]) & (triangles[:, 1] != triangles[:, 2])]
    places, reach = scale * 1.5 * rng.normal(size=(300, 3)), 0.2 * scale
    found = NearbyTriangles(points, triangles, reach).closest(places)
    far = 0
    for place, closest in zip(places, found, strict=True):
        distance = np.linalg.norm(closest_on_triangles(place, points[triangles]) - place, axis=1).min()
        if distance > reach:
            assert np.isnan(closest).all()
            far += 1
        else:
            assert np.linalg.norm(closest - place) == pytest.approx(distance, abs=1e-12 * scale)
    assert 0 < far < len(places)


@pytest.mark.parametrize("corners", [(0, 0, 1), (0, 1, 0), (0, 1, 1), (0, 0, 0), (0, 1, 2)])
def test_a_triangle_without_area_is_the_edge_that_it_is(corners):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])  # the last case is a line through three corners
    places = np.random.default_rng(5).uniform(-0.5, 2.5, size=(40, 3))
    places = np.vstack([places, points, [[0.3, 0.0, 0.0], [0.0, 0.4, 0.0]]])
    found = NearbyTriangles(points, np.array([corners]), 5.0).closest(places)
    end = float(max(corners))
    foot = np.clip(places[:, 0], 0.0, end)
    assert found == pytest.approx(np.column_stack([foot, 0.0 * foot, 0.0 * foot]))


def test_the_side_that_a_point_faces_is_the_first_of_all_that_are_turned_to_it():
    rng = np.random.default_rng(7)
    points = rng.normal(size=(60, 3))
    triangles = rng.integers(0, len(points), size=(150, 3))
    triangles = triangles[[len(set(t)) == 3 for t in triangles.tolist()]]
    places, ways = rng.normal(size=(400, 3)), rng.normal(size=(400, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    x = points[triangles]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    reach = 0.5
    distance, product = NearbyTriangles(points, triangles, reach).faced(places, ways, 0.0)
    for place, way, found, facing in zip(places, ways, distance, product, strict=True):
        to = np.flatnonzero(normal @ way < 0.0)
        lengths = np.array([ray_length(place, way, x[k : k + 1], 0.0) for k in to])
        if lengths.min() > reach:
            assert np.isinf(found)
        else:
            assert found == pytest.approx(lengths.min(), rel=1e-9)
            assert facing == pytest.approx(normal[to[lengths.argmin()]] @ way, rel=1e-9)
    assert 50 < np.isfinite(distance).sum() < 350


@pytest.mark.parametrize("behind", [0.0, 1e-4, 2e-3])
def test_a_side_just_behind_a_point_is_at_no_distance(behind):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    place = np.array([[0.2, 0.2, -behind]])
    found, product = NearbyTriangles(points, np.array([[0, 1, 2]]), 0.1).faced(place, np.array([[0.0, 0, -1]]), 1e-3)
    assert found[0] == (0.0 if behind < 1e-3 else np.inf)
    assert product[0] == (-1.0 if behind < 1e-3 else 0.0)
