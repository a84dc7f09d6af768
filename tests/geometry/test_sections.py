"""Sections against those of boxes, prisms and tubes."""

import numpy as np
import pytest
from calmotion.geometry.sections import cross_sections
from solids import box, joined, prism, rotated, tube

X = np.array([1.0, 0.0, 0.0])


def cut(solid, stations, origin=(0.0, 0.0, 0.0), axis=X):
    return cross_sections(*solid, np.array(origin, dtype=float), np.array(axis), np.array(stations, dtype=float))


def test_a_box_has_the_section_of_a_rectangle():
    found = cut(box((0.4, 0.06, 0.02), (0.0, 0.1, -0.2)), [0.05, 0.2, 0.39])
    assert found.area == pytest.approx(0.06 * 0.02)
    assert np.allclose(found.centroid, [[x, 0.13, -0.19] for x in found.stations], atol=1e-15)
    assert np.allclose(found.second, [0.06 * 0.02**3 / 12, 0.02 * 0.06**3 / 12], rtol=1e-12)
    assert np.allclose(found.extent, [0.02, 0.06]) and np.allclose(found.outline, 0.16)
    assert np.allclose(found.fill, 1.0) and np.allclose(found.compactness, 4 * np.pi * 0.0012 / 0.16**2)


def test_a_polygonal_cylinder_has_the_section_of_its_polygon():
    n, r = 12, 0.03
    found = cut(prism(n, r, 0.2), [0.1])
    angle = 2 * np.pi / n
    assert found.area[0] == pytest.approx(0.5 * n * r**2 * np.sin(angle))
    exact = n / 24 * r**4 * np.sin(angle) * (2 + np.cos(angle))
    assert np.allclose(found.second, exact, rtol=1e-12)
    assert found.outline[0] == pytest.approx(2 * n * r * np.sin(angle / 2))


def test_a_tube_is_its_outside_less_its_inside():
    found = cut(tube((0.3, 0.04, 0.04), 0.004), [0.15])
    assert found.area[0] == pytest.approx(0.04**2 - 0.032**2)
    assert np.allclose(found.second, (0.04**4 - 0.032**4) / 12, rtol=1e-12)
    assert found.outline[0] == pytest.approx(4 * (0.04 + 0.032))
    assert found.depth[0] == pytest.approx(0.004) and found.compactness[0] < 0.1


def test_an_oblique_and_distant_axis_gives_the_same_section():
    straight = cut(box((0.4, 0.06, 0.02)), [0.1, 0.3])
    turn = rotated(np.array([1.0, 2.0, -0.5]), 1.1)
    points, triangles = box((0.4, 0.06, 0.02))
    offset = np.array([30.0, -20.0, 10.0])
    found = cut((points @ turn.T + offset, triangles), [0.1, 0.3], offset + turn @ [0.0, 5.0, -3.0], turn @ X)
    for name in ("area", "second", "extent", "outline"):
        assert np.allclose(getattr(found, name), getattr(straight, name), rtol=1e-9, atol=1e-18), name
    assert np.allclose(found.centroid, straight.centroid @ turn.T + offset, atol=1e-12)


def test_a_slanted_cut_is_longer():
    found = cut(box((0.4, 0.06, 0.02)), [0.2], axis=[np.sqrt(0.5), np.sqrt(0.5), 0.0])
    assert found.area[0] == pytest.approx(np.sqrt(2.0) * 0.06 * 0.02)


def test_a_station_through_corners_is_the_section_just_beyond():
    stepped = joined(box((0.1, 0.04, 0.04)), box((0.1, 0.02, 0.02), (0.1, 0.0, 0.0)))
    found = cut(stepped, [0.0, 0.1, 0.2])
    assert np.allclose(found.area, [0.04**2, 0.02**2, 0.0], rtol=1e-12)


def test_a_station_beyond_the_body_has_no_section():
    found = cut(box((0.4, 0.06, 0.02)), [-0.1, 0.2, 0.5])
    assert found.area[[0, 2]].tolist() == [0.0, 0.0] and found.fill[[0, 2]].tolist() == [0.0, 0.0]
    assert np.isfinite(found.centroid).all() and np.array_equal(found.second[[0, 2]], np.zeros((2, 2)))
