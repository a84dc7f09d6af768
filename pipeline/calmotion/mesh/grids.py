"""Solids on grids: how often a surface winds around their corners, level sets, and narrow slits that are closed."""

import numpy as np
from scipy.ndimage import binary_closing

from calmotion.arrays import Array, BoolArray, Indices, IntArray
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import tet_volumes
from calmotion.support.compilation import inlined_kernel, kernel

_ASIDE = (0.31830989, 0.36787944)  # of a thousandth of the spacing: rays do not run along edges of CAD surfaces


def wound(points: Array, triangles: Indices, low: Array, counts: Array, spacing: float) -> Array:
    """How often a surface winds around each corner of a grid: signed crossings of rays along x.

    Args:
        points: Of the surface [m], shape [n, 3].
        triangles: Shape [m, 3], closed.
        low: First corner of the grid, which may be anywhere [m], shape [3].
        counts: Corners along each axis, shape [3].
        spacing: [m].

    Returns:
        Shape `counts`; where the surface goes on behind the grid, the last corners along x are wrong.
    """
    changes = np.zeros(tuple(counts), np.int32)
    start = low + 1e-3 * spacing * np.array([0.0, *_ASIDE])
    _count(np.ascontiguousarray(points[triangles]), start, spacing, changes)
    return np.cumsum(changes, axis=0)


@inlined_kernel
def projected_area(x: Array) -> float:
    """Twice the area of a triangle seen along x, positive where its corners turn left, shape [3, 3]."""
    return float((x[1, 1] - x[0, 1]) * (x[2, 2] - x[0, 2]) - (x[1, 2] - x[0, 2]) * (x[2, 1] - x[0, 1]))


@inlined_kernel
def ray_crossing(x: Array, area: float, y: float, z: float) -> float:
    """Where a ray along x at y and z crosses a triangle with this `projected_area`; NaN where it passes by."""
    u = ((x[1, 1] - y) * (x[2, 2] - z) - (x[1, 2] - z) * (x[2, 1] - y)) / area
    v = ((x[2, 1] - y) * (x[0, 2] - z) - (x[2, 2] - z) * (x[0, 1] - y)) / area
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        return np.nan
    return float(u * x[0, 0] + v * x[1, 0] + (1.0 - u - v) * x[2, 0])


@kernel
def _count(corners: Array, low: Array, spacing: float, changes: Array) -> None:
    """Add -1 or 1 to the first corner of the grid behind each crossing of a ray along x with a triangle."""
    for t in range(len(corners)):
        x = corners[t]
        area = projected_area(x)
        if area == 0.0:
            continue
        y0, y1 = min(x[0, 1], x[1, 1], x[2, 1]) - low[1], max(x[0, 1], x[1, 1], x[2, 1]) - low[1]
        z0, z1 = min(x[0, 2], x[1, 2], x[2, 2]) - low[2], max(x[0, 2], x[1, 2], x[2, 2]) - low[2]
        for j in range(max(int(np.ceil(y0 / spacing)), 0), min(int(y1 / spacing) + 1, changes.shape[1])):
            y = low[1] + spacing * j
            for k in range(max(int(np.ceil(z0 / spacing)), 0), min(int(z1 / spacing) + 1, changes.shape[2])):
                z = low[2] + spacing * k
                crossing = ray_crossing(x, area, y, z)
                if np.isnan(crossing):
                    continue
                i = min(max(int(np.ceil((crossing - low[0]) / spacing)), 0), changes.shape[0] - 1)
                changes[i, j, k] += -1 if area > 0.0 else 1


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


CLOSED = 2.0  # spacings: gaps that are always closed; of those up to three, some
_SQUARED = 2  # largest squared distance of a corner of the grid from the middle of the ball
_NEAR = 1.8  # spacings: the diagonal of a cell
_LEAST = 0.02  # of the spacing: corners of the grid count as no nearer to the surface, which has no flat triangles so


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
    aside = 2.5 * spacing
    low = points.min(axis=0) - aside
    counts = np.ceil((points.max(axis=0) + aside - low) / spacing).astype(np.int64) + 1
    inside = wound(points, triangles, low, counts, spacing) > 0
    ball = (np.mgrid[-1:2, -1:2, -1:2] ** 2).sum(axis=0) <= _SQUARED
    closed = binary_closing(inside, ball) | inside
    used, at, tets = grid_about(closed, low, spacing)
    near = NearbyTriangles(points, triangles, _NEAR * spacing).closest(at)
    distance = np.nan_to_num(np.linalg.norm(at - near, axis=1), nan=0.5 * spacing)
    # what is added is not bounded by the surface that is near: it ends half a spacing behind its last corner
    filled, solid = closed.ravel()[used], inside.ravel()[used]
    distance[filled & ~solid] = 0.5 * spacing
    depth = np.where(filled, 1.0, -1.0) * np.clip(distance, _LEAST * spacing, spacing)
    return zero_surface(at, depth, tets)
