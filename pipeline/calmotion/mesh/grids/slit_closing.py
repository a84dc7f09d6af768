"""A solid whose narrow slits are closed, from a grid: a wrap that is as tight everywhere.

Fillings of single slits (`mesh/surfaces/slits.py`) leave the rest of a surface as it is, and many triangles where
shells are in each other. Here the surface is made anew from what a ball cannot enter from outside: it has no slits
that are narrower, and its sharp edges are cut off within a part of the spacing.

Source: closing by a structuring element, Serra 1982, Image Analysis and Mathematical Morphology; the surface by
marching tetrahedra, Doi and Koide 1991, on those of Kuhn 1960, Some combinatorial lemmas in topology.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, BoolArray, Indices, IntArray
from calmotion.mesh.grids.winding import wound
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import tet_volumes

CLOSED = 2.0  # spacings: gaps that are always closed; of those up to three, some
_SQUARED = 2  # largest squared distance of a corner of the grid from the middle of the ball
_NEAR = 1.8  # spacings: the diagonal of a cell
_LEAST = 0.02  # of the spacing: corners of the grid count as no nearer to the surface, which has no flat triangles so
# Six tetrahedra around the diagonal of a cell, corners x + 2 y + 4 z; neighbouring cells have the same diagonals
_KUHN = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
_CELL = np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)])  # the corners of a cell, of the spacing


def closed_slits(points: Array, triangles: Indices, spacing: float) -> tuple[Array, Indices]:
    """The surface of a solid with its slits and holes of up to two spacings closed, and some of up to three.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3], closed, outward; what they wind around is solid.
        spacing: Of the grid [m]; it has some (size / spacing)^3 corners.

    Returns:
        Points [m], shape [k, 3], and triangles, shape [l, 3], closed and outward, some seven for each cell of the
        grid on the surface.
    """
    from scipy.ndimage import binary_closing

    aside = 2.5 * spacing
    low = points.min(axis=0) - aside
    counts = np.ceil((points.max(axis=0) + aside - low) / spacing).astype(np.int64) + 1
    inside = wound(points, triangles, low, counts, spacing) > 0
    ball = (np.mgrid[-1:2, -1:2, -1:2] ** 2).sum(axis=0) <= _SQUARED
    closed = binary_closing(inside, ball) | inside
    used, tets = _kuhn_tets(_cells_with(closed) & _cells_with(~closed), closed.shape)
    at = low + spacing * np.stack(np.unravel_index(used, closed.shape), axis=1)
    near = NearbyTriangles(points, triangles, _NEAR * spacing).closest(at)
    distance = np.nan_to_num(np.linalg.norm(at - near, axis=1), nan=0.5 * spacing)
    # what is added is not bounded by the surface that is near: it ends half a spacing behind its last corner
    filled, solid = closed.ravel()[used], inside.ravel()[used]
    distance[filled & ~solid] = 0.5 * spacing
    depth = np.where(filled, 1.0, -1.0) * np.clip(distance, _LEAST * spacing, spacing)
    return _zero_surface(at, depth, tets)


def _cells_with(corners: BoolArray) -> BoolArray:
    """Whether each cell of a grid has one of some corners, shape (n - 1, m - 1, k - 1).

    Args:
        corners: Shape (n, m, k).
    """
    some = corners
    for axis in range(3):
        last = some.shape[axis] - 1
        some = np.take(some, range(last), axis) | np.take(some, range(1, last + 1), axis)
    return some


def _kuhn_tets(cells: BoolArray, shape: tuple[int, ...]) -> tuple[Indices, IntArray]:
    """The corners of the grid that some cells have, ascending, and the tetrahedra of these cells with their places.

    Args:
        cells: Which, shape (n - 1, m - 1, k - 1).
        shape: Of the grid's corners.
    """
    first = np.ravel_multi_index(np.nonzero(cells), shape)
    used, place = np.unique(first[:, None] + np.ravel_multi_index(tuple(_CELL.T), shape), return_inverse=True)
    return np.asarray(used, np.int64), place.reshape(-1, 8)[:, _KUHN].reshape(-1, 4).astype(np.int32)


def _zero_surface(at: Array, depth: Array, tets: Indices) -> tuple[Array, Indices]:
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
