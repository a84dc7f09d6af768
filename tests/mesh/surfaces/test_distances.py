"""Closest points and rays."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.mesh.surfaces.distances import closest_on_triangles, meets_plane, ray_length

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
