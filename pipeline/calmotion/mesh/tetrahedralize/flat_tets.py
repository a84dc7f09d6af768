"""Flat tetrahedra of a mesh get a volume by a small move of one of their corners."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, Indices, IntArray
from calmotion.mesh.tetrahedra import flat_tets, tet_volumes

_MOVES = (0.01, 0.03, 0.1)  # of the longest edge of the flat tetrahedron
_LEAST = 1e-4  # least volume of the tetrahedra around the corner after the move, of the cube of their longest edge
_ROUNDS = 3


def unflattened(points: Array, tets: IntArray) -> Array:
    """The points, of which some are moved so that tetrahedra without volume get one.

    A mesher leaves single such tetrahedra where four points are in one plane. The corner is moved across this plane,
    as far as no other tetrahedron is turned over or flattened by it; where that is not possible it stays.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], of either orientation.
    """
    moved = np.array(points, dtype=float)
    for _ in range(_ROUNDS):
        flat = np.flatnonzero(flat_tets(moved, tets))
        if len(flat) == 0:
            break
        for element in flat:
            _move_one(moved, tets, int(element), flat)
    return moved


def _move_one(points: Array, tets: IntArray, element: int, flat: Indices) -> None:
    """Move the corner of a flat tetrahedron that leaves the best shapes around it."""
    x = points[tets[element]]
    edges = x[[1, 2, 3, 2, 3, 3]] - x[[0, 0, 0, 1, 1, 2]]
    longest = float(np.linalg.norm(edges, axis=1).max())
    normal = np.linalg.svd(x - x.mean(axis=0))[2][2]
    best, shape = None, _LEAST
    for corner in tets[element]:
        around = np.flatnonzero((tets == corner).any(axis=1))
        others = around[~np.isin(around, flat)]
        sign = np.sign(tet_volumes(points, tets[others]))
        kept = points[corner].copy()
        for step in (s * m * longest for m in _MOVES for s in (1.0, -1.0)):
            points[corner] = kept + step * normal
            worst = min(
                _shapes(points, tets[others], sign).min(initial=np.inf),
                float(np.abs(_shapes(points, tets[[element]], np.ones(1)))[0]),
            )
            if worst > shape:
                best, shape = (int(corner), points[corner].copy()), worst
        points[corner] = kept
    if best is not None:
        points[best[0]] = best[1]


def _shapes(points: Array, tets: IntArray, sign: Array) -> Array:
    """Volume over the cube of the longest edge, negative where the sign has changed, shape [m]."""
    x = points[tets]
    edge = np.linalg.norm(x[:, [1, 2, 3, 2, 3, 3]] - x[:, [0, 0, 0, 1, 1, 2]], axis=-1).max(axis=1)
    return np.asarray(sign * tet_volumes(points, tets) / np.maximum(edge**3, np.finfo(float).tiny))
