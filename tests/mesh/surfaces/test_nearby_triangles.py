"""The grid of triangles against the distances to all triangles."""

import numpy as np
import pytest
from calmotion.mesh.surfaces.distances import closest_on_triangles, ray_length
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles


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
