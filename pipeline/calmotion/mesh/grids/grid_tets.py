"""Tetrahedra of a regular grid, cut along a surface: any surface is meshed within seconds, whatever its triangles.

Surfaces of CAD assemblies have tens of thousands of triangles for screws, splines and letters, of which a mesher that
follows each triangle makes elements for minutes. A grid does not see what is smaller than its spacing; flat walls and
round ones stay where they are, and sharp edges are cut off within a part of the spacing.

Source: Labelle and Shewchuk 2007, Isosurface Stuffing, on the tetrahedra of Kuhn 1960, Some combinatorial lemmas in
topology.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, BoolArray, Indices, IntArray
from calmotion.mesh.grids.contacts import without_contacts
from calmotion.mesh.grids.winding import wound
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import largest_part, tet_volumes, without_unused_points

GRID = 1.12  # edge of a regular tetrahedron of the volume of a grid's, of the spacing
_SNAP = 0.25  # of the spacing: corners of the grid so close to the surface are moved onto it
_REACH = 1.8  # of the spacing: the diagonal of a cell
_FLAT = 1e-3  # of the volume of a tetrahedron of the grid: no smaller ones are made
# Six tetrahedra around the diagonal of a cell, corners x + 2 y + 4 z; neighbouring cells have the same diagonals
_KUHN = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
_CELL = np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)])  # the corners of a cell, of the spacing


def grid_tets(points: Array, triangles: Indices, spacing: float) -> tuple[Array, IntArray]:
    """Points [m], shape [k, 3], and tetrahedra, shape [e, 4], of positive volume, in one piece.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3], closed, outward; what they wind around is filled.
        spacing: Of the grid [m].

    Raises:
        ValueError: The grid has no corner inside.
    """
    low = points.min(axis=0) - 1.5 * spacing
    counts = np.ceil((points.max(axis=0) + 1.5 * spacing - low) / spacing).astype(np.int64) + 1
    inside = wound(points, triangles, low, counts, spacing) > 0
    if not inside.any():
        raise ValueError("the grid has no corner inside the surface")
    used, tets = kuhn_tets(cells_with(inside), inside.shape)
    at = low + spacing * np.stack(np.unravel_index(used, inside.shape), axis=1)
    near = NearbyTriangles(points, triangles, _REACH * spacing).closest(at)
    distance = np.nan_to_num(np.linalg.norm(at - near, axis=1), nan=_REACH * spacing)
    depth = np.where(inside.ravel()[used], 1.0, -1.0) * np.maximum(distance, 1e-9 * spacing)
    tets = tets[(depth[tets] > 0.0).any(axis=1)]
    at, depth = _snapped(at, depth, near, tets, spacing)
    made, cut = _cut(at, depth, tets)
    made, cut = _in_one_piece(made, cut[np.abs(tet_volumes(made, cut)) > _FLAT * spacing**3 / 6.0])
    return without_contacts(made, cut, points, triangles, 0.5 * spacing)


def cells_with(corners: BoolArray) -> BoolArray:
    """Whether each cell of a grid has one of some corners, shape (n - 1, m - 1, k - 1).

    Args:
        corners: Shape (n, m, k).
    """
    some = corners
    for axis in range(3):
        last = some.shape[axis] - 1
        some = np.take(some, range(last), axis) | np.take(some, range(1, last + 1), axis)
    return some


def kuhn_tets(cells: BoolArray, shape: tuple[int, ...]) -> tuple[Indices, IntArray]:
    """The corners of the grid that some cells have, ascending, and the tetrahedra of these cells with their places.

    Args:
        cells: Which, shape (n - 1, m - 1, k - 1).
        shape: Of the grid's corners.
    """
    first = np.ravel_multi_index(np.nonzero(cells), shape)
    used, place = np.unique(first[:, None] + np.ravel_multi_index(tuple(_CELL.T), shape), return_inverse=True)
    return np.asarray(used, np.int64), place.reshape(-1, 8)[:, _KUHN].reshape(-1, 4).astype(np.int32)


def _snapped(at: Array, depth: Array, near: Array, tets: IntArray, spacing: float) -> tuple[Array, Array]:
    """The grid with corners that are close to the surface on it, as far as no tetrahedron becomes flat by that."""
    chosen = np.abs(depth) < _SNAP * spacing
    for _ in range(10):
        moved = np.where(chosen[:, None], near, at)
        flat = np.abs(tet_volumes(moved, tets)) < 0.05 * spacing**3 / 6.0
        if not (flat[:, None] & chosen[tets]).any():
            break
        chosen[tets[flat]] = False
    return moved, np.where(chosen, 0.0, depth)


def _cut(at: Array, depth: Array, tets: IntArray) -> tuple[Array, IntArray]:
    """Points and tetrahedra of the part with positive depth, which is linear between corners."""
    # corners inside first, in the order of their numbers, so that neighbours cut their common side alike; then those
    # on the surface, then those outside
    kind = np.where(depth > 0.0, 0, np.where(depth == 0.0, 1, 2))
    order = np.lexsort((tets, kind[tets]), axis=1)
    tets = np.take_along_axis(tets, order, axis=1)
    within, on = (kind[tets] == 0).sum(axis=1), (kind[tets] == 1).sum(axis=1)
    pieces: list[IntArray] = []  # corners as pairs: a point itself, or that between a corner inside and one outside

    def add(selected: Array, *wanted: tuple[int, int]) -> None:
        chosen = tets[selected]
        pieces.append(np.stack([np.stack([chosen[:, a], chosen[:, b]], axis=1) for a, b in wanted], axis=1))

    add((within > 0) & (within + on == 4), (0, 0), (1, 1), (2, 2), (3, 3))
    one = (within == 1) & (on < 3)
    for number in range(3):
        corners = [(k, k) if k <= number else (0, k) for k in range(1, 4)]
        add(one & (on == number), (0, 0), *corners)
    pyramid = (within == 2) & (on == 1)
    add(pyramid, (2, 2), (0, 0), (1, 1), (1, 3))
    add(pyramid, (2, 2), (0, 0), (1, 3), (0, 3))
    wedge = (within == 2) & (on == 0)
    add(wedge, (0, 0), (1, 1), (1, 2), (1, 3))
    add(wedge, (0, 0), (0, 2), (1, 2), (1, 3))
    add(wedge, (0, 0), (0, 2), (0, 3), (1, 3))
    prism = (within == 3) & (on == 0)
    add(prism, (0, 0), (1, 1), (2, 2), (2, 3))
    add(prism, (0, 0), (1, 1), (1, 3), (2, 3))
    add(prism, (0, 0), (0, 3), (1, 3), (2, 3))
    ends = np.sort(np.concatenate(pieces), axis=2)
    keys, made = np.unique(ends[..., 0].astype(np.int64) * len(at) + ends[..., 1], return_inverse=True)
    a, b = keys // len(at), keys % len(at)
    whole = a == b
    share = np.where(whole, 0.0, depth[a] / np.where(whole, 1.0, depth[a] - depth[b]))
    return at[a] + share[:, None] * (at[b] - at[a]), made.reshape(-1, 4).astype(np.int32)


def _in_one_piece(points: Array, tets: IntArray) -> tuple[Array, IntArray]:
    """The largest part of the tetrahedra, with positive volumes."""
    tets = largest_part(points, tets)
    inverted = tet_volumes(points, tets) < 0.0
    tets[inverted] = tets[inverted][:, [1, 0, 2, 3]]
    return without_unused_points(points, tets)
