"""Closed surfaces where a function on the corners of a grid is zero.

Source: marching tetrahedra, Doi and Koide 1991, on those of Kuhn 1960, Some combinatorial lemmas in topology.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, BoolArray, Indices, IntArray
from calmotion.mesh.tetrahedra import tet_volumes

# Six tetrahedra around the diagonal of a cell, corners x + 2 y + 4 z; neighbouring cells have the same diagonals
_KUHN = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
_CELL = np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)])  # the corners of a cell, of the spacing


def grid_about(inside: BoolArray, low: Array, spacing: float) -> tuple[Indices, Array, IntArray]:
    """The part of a grid at the boundary of what is inside.

    Args:
        inside: Whether each corner is, shape (n, m, k); none on the sides of the grid.
        low: First corner [m], shape [3].
        spacing: [m].

    Returns:
        Indices of the corners of this part, ascending; their places [m]; and its tetrahedra with these corners.
    """
    cells = _cells_with(inside) & _cells_with(~inside)
    first = np.ravel_multi_index(np.nonzero(cells), inside.shape)
    used, place = np.unique(first[:, None] + np.ravel_multi_index(tuple(_CELL.T), inside.shape), return_inverse=True)
    at = low + spacing * np.stack(np.unravel_index(used, inside.shape), axis=1)
    return np.asarray(used, np.int64), at, place.reshape(-1, 8)[:, _KUHN].reshape(-1, 4).astype(np.int32)


def _cells_with(corners: BoolArray) -> BoolArray:
    """Whether each cell of a grid has one of some corners, shape (n - 1, m - 1, k - 1)."""
    some = corners
    for axis in range(3):
        last = some.shape[axis] - 1
        some = np.take(some, range(last), axis) | np.take(some, range(1, last + 1), axis)
    return some


def zero_surface(at: Array, depth: Array, tets: Indices) -> tuple[Array, Indices]:
    """Where a depth is zero that is linear in each tetrahedron: points and triangles, towards negative depth."""
    inside = depth > 0.0
    order = np.argsort(~inside[tets], axis=1, kind="stable")
    tets = np.take_along_axis(tets, order, axis=1)
    within = inside[tets].sum(axis=1)
    pieces: list[Indices] = []  # corners as pairs, of a corner inside and one outside
    for count, corners in (
        (1, ((0, 1), (0, 2), (0, 3))),
        (3, ((0, 3), (1, 3), (2, 3))),
        (2, ((0, 2), (0, 3), (1, 3))),
        (2, ((0, 2), (1, 3), (1, 2))),
    ):
        chosen = tets[within == count]
        piece = chosen[:, corners]
        mirrored = tet_volumes(at, chosen) < 0.0
        piece[mirrored] = piece[mirrored][:, ::-1]
        pieces.append(piece)
    ends = np.concatenate(pieces).astype(np.int64)
    keys, made = np.unique(ends[..., 0] * len(at) + ends[..., 1], return_inverse=True)
    a, b = keys // len(at), keys % len(at)
    share = depth[a] / (depth[a] - depth[b])
    return at[a] + share[:, None] * (at[b] - at[a]), made.reshape(-1, 3)
