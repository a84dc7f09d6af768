"""Polygons as triangles."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.usd.reading.bodies.polygons import triangulate

ARROW = np.array([[0.0, 0], [2, -1], [1, 0], [2, 1]])  # dented at its third corner
U = np.array([[0.0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]])
COMB = np.array([[0.0, 0], [9, 0], [9, 2], [8, 2], [8, 1], [5, 1], [5, 2], [4, 2], [4, 1], [1, 1], [1, 2], [0, 2]])


def areas(x, triangles):
    return 0.5 * np.cross(x[triangles[:, 1]] - x[triangles[:, 0]], x[triangles[:, 2]] - x[triangles[:, 0]])


def cut(ring, turn=None):
    points = np.column_stack([ring, np.zeros(len(ring))])
    if turn is not None:
        points = points @ turn.T
    counts, corners = np.array([len(ring)], dtype=np.int32), np.arange(len(ring), dtype=np.int32)
    return points, triangulate(points, counts, corners, np.ones(1, dtype=bool))


def area_of(ring):
    x, y = ring.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


@pytest.mark.parametrize("ring", [ARROW, U, COMB, ARROW[[2, 3, 0, 1]], np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])])
def test_a_polygon_is_covered_once_dented_or_not(ring):
    points, triangles = cut(ring)
    pieces = areas(points, triangles)[:, 2]
    assert len(triangles) == len(ring) - 2
    # every piece faces as the polygon does, so the pieces cannot overlap when their areas add up
    assert (pieces > 0.0).all() and pieces.sum() == pytest.approx(area_of(ring), rel=1e-12)


@pytest.mark.parametrize("ring", [U, U[::-1]])
def test_pieces_face_as_the_polygon_does_wherever_it_lies(ring):
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    points, triangles = cut(ring, turn)
    pieces = areas(points, triangles) @ turn[:, 2]
    assert pieces == pytest.approx(np.abs(pieces) * np.sign(area_of(ring)))
    assert pieces.sum() == pytest.approx(area_of(ring))


def test_polygons_stay_in_order_and_unwanted_ones_go():
    points = np.vstack([np.column_stack([ring, np.full(len(ring), z)]) for ring, z in ((ARROW, 0.0), (U, 1.0))])
    counts = np.array([4, 2, 8, 3], dtype=np.int32)
    corners = np.array([0, 1, 2, 3, 0, 1, 4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 3], dtype=np.int32)
    triangles = triangulate(points, counts, corners, np.array([True, True, True, False]))
    assert triangles.dtype == np.int32 and len(triangles) == 2 + 6
    assert (triangles[:2] < 4).all() and (triangles[2:] >= 4).all()


def test_a_polygon_that_crosses_itself_still_gives_its_number_of_triangles():
    bow = np.array([[0.0, 0], [1, 1], [1, 0], [0, 1]])
    assert len(cut(bow)[1]) == 2
