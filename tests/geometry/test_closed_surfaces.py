"""Surfaces as chains of triangles."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.geometry.closed_surfaces import boundary_walks, close, winding_number
from calmotion.geometry.tetrahedra import boundary_triangles, surface_volume


@pytest.fixture
def box(helpers):
    points, tets = helpers.box((4, 4, 4), (1.0, 1.0, 1.0))
    return points, boundary_triangles(tets)


def test_a_closed_surface_has_no_boundary(box):
    assert boundary_walks(box[1]) == []
    assert len(close(*box).areas) == 0


@pytest.mark.parametrize("missing", [1, 2, 5, 32])
def test_holes_are_closed_and_the_volume_comes_back(box, missing):
    points, triangles = box
    top = np.flatnonzero((points[triangles][:, :, 2] > 1 - 1e-9).all(axis=1))
    order = np.argsort(points[triangles[top]].mean(axis=1) @ [1.0, 10.0, 0.0])
    closure = close(points, np.delete(triangles, top[order[:missing]], axis=0))
    assert boundary_walks(closure.triangles) == []
    # the holes are flat, so their caps lie in them
    assert surface_volume(closure.points, closure.triangles) == pytest.approx(1.0, rel=1e-12)
    assert closure.areas.sum() == pytest.approx(missing / 32.0, rel=0.5)
    assert len(closure.sides) == len(closure.areas) and (missing > 1 or closure.sides.tolist() == [3])


def test_two_holes_that_touch_at_a_corner_are_closed_apart(box):
    points, triangles = box
    corner = int(np.flatnonzero(np.linalg.norm(points - [0.5, 0.5, 1.0], axis=1) < 1e-9)[0])
    touching = np.flatnonzero((triangles == corner).any(axis=1))
    first = touching[0]
    apart = [t for t in touching if len(np.intersect1d(triangles[t], triangles[first])) == 1]
    closure = close(points, np.delete(triangles, [first, apart[0]], axis=0))
    assert len(closure.areas) == 2
    assert surface_volume(closure.points, closure.triangles) == pytest.approx(1.0, rel=1e-12)


def test_the_winding_number_distinguishes_inside_outside_and_twice_inside(box):
    points, triangles = box
    assert winding_number(np.array([0.4, 0.5, 0.6]), points, triangles) == pytest.approx(1.0)
    assert winding_number(np.array([1.4, 0.5, 0.6]), points, triangles) == pytest.approx(0.0, abs=1e-12)
    double = np.vstack([triangles, triangles + len(points)])
    assert winding_number(np.array([0.4, 0.5, 0.6]), np.vstack([points, points + 0.1]), double) == pytest.approx(2.0)
