"""Tetrahedra of a regular grid, cut along a surface: any surface is meshed within seconds, whatever its triangles.

Surfaces of CAD assemblies have tens of thousands of triangles for screws, splines and letters, of which a mesher that
follows each triangle makes elements for minutes. A grid does not see what is smaller than its spacing; flat walls and
round ones stay where they are, and sharp edges are cut off within a part of the spacing.

Source: Labelle and Shewchuk 2007, Isosurface Stuffing, on the tetrahedra of Kuhn 1960, Some combinatorial lemmas in
topology.
"""

from __future__ import annotations

import numpy as np

from calmotion.geometry.grids.contacts import without_contacts
from calmotion.geometry.nearby_triangles import NearbyTriangles
from calmotion.geometry.tetrahedra import Indices, largest_part, tet_volumes, without_unused_points
from calmotion.shot.character import Array, BoolArray, IntArray
from calmotion.support.compilation import kernel

GRID = 1.12  # edge of a regular tetrahedron of the volume of a grid's, of the spacing
_SNAP = 0.25  # of the spacing: corners of the grid so close to the surface are moved onto it
_REACH = 1.8  # of the spacing: the diagonal of a cell
_FLAT = 1e-3  # of the volume of a tetrahedron of the grid: no smaller ones are made
_ASIDE = (0.31830989, 0.36787944)  # of a thousandth of the spacing: rays do not run along edges of CAD surfaces
# Six tetrahedra around the diagonal of a cell, corners x + 2 y + 4 z; neighbouring cells have the same diagonals
_KUHN = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])


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
    inside = _wound(points, triangles, low, counts, spacing) > 0
    if not inside.any():
        raise ValueError("the grid has no corner inside the surface")
    corners = _cells(inside)[:, None] + np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)]) @ np.array(
        [counts[1] * counts[2], counts[2], 1]
    )
    used, place = np.unique(corners, return_inverse=True)
    at = low + spacing * np.stack(np.unravel_index(used, tuple(counts)), axis=1)
    tets = place.reshape(-1, 8)[:, _KUHN].reshape(-1, 4).astype(np.int32)
    near = NearbyTriangles(points, triangles, _REACH * spacing).closest(at)
    distance = np.nan_to_num(np.linalg.norm(at - near, axis=1), nan=_REACH * spacing)
    depth = np.where(inside.ravel()[used], 1.0, -1.0) * np.maximum(distance, 1e-9 * spacing)
    tets = tets[(depth[tets] > 0.0).any(axis=1)]
    at, depth = _snapped(at, depth, near, tets, spacing)
    made, cut = _cut(at, depth, tets)
    return _in_one_piece(made, cut[np.abs(tet_volumes(made, cut)) > _FLAT * spacing**3 / 6.0])


def _cells(inside: BoolArray) -> Indices:
    """First corners of the cells with a corner inside."""
    some = inside
    for axis in range(3):
        last = some.shape[axis] - 1
        some = np.take(some, range(last), axis) | np.take(some, range(1, last + 1), axis)
    return np.asarray(np.ravel_multi_index(np.nonzero(some), inside.shape), np.int64)


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
    """The largest part of the tetrahedra, with positive volumes and without contacts in points and edges."""
    tets = largest_part(points, tets)
    inverted = tet_volumes(points, tets) < 0.0
    tets[inverted] = tets[inverted][:, [1, 0, 2, 3]]
    return without_contacts(*without_unused_points(points, tets))


def _wound(points: Array, triangles: Indices, low: Array, counts: Array, spacing: float) -> Array:
    """How often a surface winds around each corner of a grid, shape `counts`: signed crossings of rays along x."""
    changes = np.zeros(tuple(counts), np.int32)
    start = low + 1e-3 * spacing * np.array([0.0, *_ASIDE])
    _count(np.ascontiguousarray(points[triangles]), start, spacing, changes)
    return np.cumsum(changes, axis=0)


@kernel
def _count(corners: Array, low: Array, spacing: float, changes: Array) -> None:
    """Add -1 or 1 to the first corner of the grid behind each crossing of a ray along x with a triangle."""
    for t in range(len(corners)):
        x = corners[t]
        area = (x[1, 1] - x[0, 1]) * (x[2, 2] - x[0, 2]) - (x[1, 2] - x[0, 2]) * (x[2, 1] - x[0, 1])
        if area == 0.0:
            continue
        y0, y1 = min(x[0, 1], x[1, 1], x[2, 1]) - low[1], max(x[0, 1], x[1, 1], x[2, 1]) - low[1]
        z0, z1 = min(x[0, 2], x[1, 2], x[2, 2]) - low[2], max(x[0, 2], x[1, 2], x[2, 2]) - low[2]
        for j in range(max(int(np.ceil(y0 / spacing)), 0), min(int(y1 / spacing) + 1, changes.shape[1])):
            y = low[1] + spacing * j
            for k in range(max(int(np.ceil(z0 / spacing)), 0), min(int(z1 / spacing) + 1, changes.shape[2])):
                z = low[2] + spacing * k
                u = ((x[1, 1] - y) * (x[2, 2] - z) - (x[1, 2] - z) * (x[2, 1] - y)) / area
                v = ((x[2, 1] - y) * (x[0, 2] - z) - (x[2, 2] - z) * (x[0, 1] - y)) / area
                if u < 0.0 or v < 0.0 or u + v > 1.0:
                    continue
                crossing = u * x[0, 0] + v * x[1, 0] + (1.0 - u - v) * x[2, 0]
                i = min(max(int(np.ceil((crossing - low[0]) / spacing)), 0), changes.shape[0] - 1)
                changes[i, j, k] += -1 if area > 0.0 else 1
