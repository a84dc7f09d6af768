"""Integrals of solids against exact values."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.model import MassProperties
from calmotion.usd.reading.bodies.moments import is_closed, sum_of, surface_moments, tetrahedron_moments

BOX_TRIANGLES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]], dtype=np.int32,
)  # fmt: skip


def box(size, center) -> np.ndarray:
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return corners * size + center


def test_a_box_far_from_the_origin_has_its_exact_inertia():
    a, b, c = 0.4, 0.2, 0.1
    moments = surface_moments(box([a, b, c], [10.0, -20.0, 30.0]), BOX_TRIANGLES)
    assert moments.volume == pytest.approx(a * b * c, rel=1e-12)
    assert np.allclose(moments.center, [10.0, -20.0, 30.0], atol=1e-12)
    mass = moments.mass_properties(1000.0)
    m = 1000.0 * a * b * c
    assert np.allclose(
        mass.inertia, m / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b]), rtol=1e-9, atol=1e-12
    )


def test_a_surface_that_is_inside_out_is_turned():
    right = surface_moments(box([1, 2, 3], [0, 0, 0]), BOX_TRIANGLES)
    wrong = surface_moments(box([1, 2, 3], [0, 0, 0]), BOX_TRIANGLES[:, ::-1])
    assert wrong.volume == pytest.approx(right.volume) and np.allclose(wrong.second, right.second)


def test_a_single_tetrahedron_has_the_second_moments_of_the_literature():
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]])
    moments = tetrahedron_moments(corners)
    assert moments.volume == pytest.approx(1 / 6)
    # integral of x^2 is 1/60, of x y is 1/120, about the corner
    about_corner = moments.second + moments.volume * np.outer(moments.center, moments.center)
    assert np.allclose(about_corner, np.full((3, 3), 1 / 120) + np.eye(3) / 120)


def test_moments_of_a_mapped_solid_are_the_mapped_moments():
    linear = np.array([[1.0, 0.4, 0], [0, 2.0, -0.3], [0.1, 0, -1.5]])
    points = box([1, 2, 3], [0.2, 0.3, 0.4])
    direct = surface_moments(points @ linear.T + [1, 2, 3], BOX_TRIANGLES)
    mapped = surface_moments(points, BOX_TRIANGLES).mapped(linear, np.array([1.0, 2, 3]))
    assert direct.volume == pytest.approx(mapped.volume)
    assert np.allclose(direct.center, mapped.center) and np.allclose(direct.second, mapped.second)


def test_closed_means_every_edge_twice_and_opposite():
    points = box([1, 1, 1], [0, 0, 0])
    assert is_closed(BOX_TRIANGLES, points)
    assert not is_closed(BOX_TRIANGLES[:-1], points)
    flipped = BOX_TRIANGLES.copy()
    flipped[0] = flipped[0][::-1]
    assert not is_closed(flipped, points)
    split = points[BOX_TRIANGLES].reshape(-1, 3)  # every triangle with points of its own
    assert is_closed(np.arange(len(split), dtype=np.int32).reshape(-1, 3), split)


def test_two_halves_make_the_whole():
    whole = surface_moments(box([2, 1, 1], [0, 0, 0]), BOX_TRIANGLES).mass_properties(5.0)
    halves = [surface_moments(box([1, 1, 1], [x, 0, 0]), BOX_TRIANGLES).mass_properties(5.0) for x in (-0.5, 0.5)]
    found = sum_of(halves)
    assert isinstance(found, MassProperties)
    assert found.mass == pytest.approx(whole.mass) and np.allclose(found.inertia, whole.inertia)
