"""Flat tetrahedra get a volume, and nothing else changes."""

from __future__ import annotations

import numpy as np
from calmotion.mesh.tetrahedra import flat_tets, tet_volumes
from calmotion.mesh.tetrahedralize.flat_tets import unflattened


def with_flat_element():
    """Two pyramids over and under a square, with a flat tetrahedron that fills the square between them."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1], [0.5, 0.5, -1]])
    above = [[0, 1, 2, 4], [0, 2, 3, 4]]
    below = [[0, 3, 1, 5], [1, 3, 2, 5]]
    return points, np.array([*above, *below, [0, 1, 2, 3]], dtype=np.int32)


def test_a_flat_tetrahedron_gets_a_volume_and_no_other_turns_over():
    points, tets = with_flat_element()
    assert flat_tets(points, tets).tolist() == [False] * 4 + [True]
    before = tet_volumes(points, tets)
    moved = unflattened(points, tets)
    after = tet_volumes(moved, tets)
    assert not flat_tets(moved, tets).any() and abs(after[4]) > 1e-4
    assert (np.sign(after[:4]) == np.sign(before[:4])).all()
    # one corner has moved, a little
    assert np.linalg.norm(moved - points, axis=1).max() < 0.15 and (moved != points).any(axis=1).sum() == 1


def test_the_sum_of_the_volumes_stays_where_the_corner_is_inside(helpers):
    points, tets = helpers.box((2, 2, 2), (1.0, 1.0, 1.0))
    assert np.array_equal(unflattened(points, tets), points)


def test_a_tetrahedron_that_cannot_be_helped_stays():
    points = np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]])
    assert np.array_equal(unflattened(points, np.array([[0, 1, 2, 3]], dtype=np.int32)), points)
