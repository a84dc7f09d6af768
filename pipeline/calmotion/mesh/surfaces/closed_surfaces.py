"""Triangulated surfaces as oriented chains: boundaries, closing of small holes, inside and outside."""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, Indices
from calmotion.mesh.surfaces.distances import solid_angles
from calmotion.mesh.surfaces.orientation import directed_edges
from calmotion.mesh.tetrahedra import surface_area

# Number of triangles, and of places, below which each is counted; distance from which a group counts as a dipole, of
# its radius
_FEW, _FAR = 2_000, 3.0
_CELLS = 40_000  # of the grid on which a volume is sampled


@dataclass(frozen=True, eq=False)
class Closure:
    """A surface with its holes capped.

    Attributes:
        points: [m], shape [n, 3]; those of the input, then one for each cap of more than three edges.
        triangles: Shape [m, 3]; those of the input, then the caps.
        areas: Area of each cap [m^2].
        sides: Number of edges of each cap.
    """

    points: Array
    triangles: Indices
    areas: Array
    sides: Indices


def boundary_walks(triangles: Indices) -> list[list[int]]:
    """Closed walks along the boundary of a consistently oriented surface, in the orientation of the caps.

    Edges are counted with their direction: the boundary is the chain of edges that do not cancel, also where an edge
    has four triangles. The boundary of a boundary is zero, so as many edges leave each corner as arrive there, and all
    walks are closed.
    """
    edge, forward = directed_edges(triangles)
    net = np.bincount(edge, np.where(forward, 1.0, -1.0)).astype(int)
    open_edges, sides = np.unique(edge, return_index=True)
    open_edges, sides = open_edges[net != 0], sides[net != 0]
    ends = np.stack([triangles.ravel()[sides], np.roll(triangles, -1, axis=1).ravel()[sides]], axis=1)
    leaving: dict[int, list[int]] = {}
    for (a, b), count in zip(np.sort(ends, axis=1).tolist(), net[open_edges].tolist(), strict=True):
        # the cap has the opposite direction along the common edge
        tail, head = (b, a) if count > 0 else (a, b)
        leaving.setdefault(tail, []).extend([head] * abs(count))
    walks = []
    for corner in sorted(leaving):
        while leaving[corner]:
            place = corner
            walk: list[int] = []
            at: dict[int, int] = {}
            while leaving.get(place):
                at[place] = len(walk)
                walk.append(place)
                place = leaving[place].pop()
                if place in at:  # the walk closes here: remove this part, and continue from its corner
                    loop = walk[at[place] :]
                    for corner_of_loop in loop:
                        del at[corner_of_loop]
                    walk = walk[: len(walk) - len(loop)]
                    walks.append(loop)
    return walks


def close(points: Array, triangles: Indices) -> Closure:
    """Cap each hole of a consistently oriented surface with a fan of triangles.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].
    """
    new_points, new_triangles = [points], [triangles]
    areas, sides = [], []
    count = len(points)
    for walk in boundary_walks(triangles):
        if len(walk) < 3:
            continue
        if len(walk) == 3:
            cap, corners = np.array([walk]), points
        else:
            center = points[walk].mean(axis=0)
            cap = np.array([[a, b, count] for a, b in zip(walk, walk[1:] + walk[:1], strict=True)])
            new_points.append(center[None])
            corners = np.vstack(new_points)
            count += 1
        new_triangles.append(cap)
        areas.append(surface_area(corners, cap))
        sides.append(len(walk))
    return Closure(np.vstack(new_points), np.vstack(new_triangles), np.array(areas), np.array(sides, dtype=int))


def winding_number(point: Array, points: Array, triangles: Indices) -> float:
    """Winding number of a surface around a point: 1 inside a closed outward surface, 0 outside.

    Source: van Oosterom and Strackee 1983 (solid angle of a triangle); Jacobson et al. 2013.
    """
    return _solid_angle(point, points[triangles]) / (4.0 * np.pi)


def winding_numbers(places: Array, points: Array, triangles: Indices) -> Array:
    """Winding numbers of a surface around many places, where a large surface would take minutes place by place.

    Triangles are grouped by the cell of a grid that they are in. A group that is far from a place counts as a dipole,
    whose error is at most a few thousandths here; near groups and small surfaces are exact.

    Args:
        places: Shape [k, 3].
        points: Shape [n, 3].
        triangles: Shape [m, 3].

    Returns:
        Shape [k].

    Source: Barill, Dickson, Schmidt, Levin and Jacobson 2018, Fast Winding Numbers for Soups and Clouds.
    """
    corners = points[triangles]
    if len(triangles) < _FEW and len(places) < _FEW:
        return np.array([_solid_angle(place, corners) for place in places]) / (4.0 * np.pi)
    centers = corners.mean(axis=1)
    low = centers.min(axis=0)
    width = float(np.ptp(centers, axis=0).max()) / np.ceil(len(triangles) ** 0.25)  # about sqrt(m) cells have triangles
    cells = np.minimum(((centers - low) / width).astype(np.int64), 2**20 - 1) @ np.array([1 << 40, 1 << 20, 1])
    order = np.argsort(cells, kind="stable")
    corners = np.ascontiguousarray(corners[order])
    starts = np.flatnonzero(np.diff(cells[order], prepend=-1))
    bounds = np.append(starts, len(order))
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    dipoles = np.add.reduceat(area, starts, axis=0)
    middles = np.add.reduceat(centers[order], starts, axis=0) / np.diff(bounds)[:, None]
    offsets = np.linalg.norm(corners - np.repeat(middles, np.diff(bounds), axis=0)[:, None], axis=2).max(axis=1)
    reach = _FAR * np.maximum.reduceat(offsets, starts)
    angles = np.empty(len(places))
    solid_angles(np.ascontiguousarray(places), corners, bounds, dipoles, middles, reach, angles)
    return angles / (4.0 * np.pi)


def enclosed_volume(points: Array, triangles: Indices) -> float:
    """Volume that a surface winds around at least once [m^3]: of one that intersects itself, whatever its signs.

    It is sampled on a grid, with an error of some tenths of a percent.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].
    """
    low, high = points[triangles].min(axis=(0, 1)), points[triangles].max(axis=(0, 1))
    size = high - low
    cells = np.maximum(np.round(size * (_CELLS / float(np.prod(size))) ** (1.0 / 3.0)), 4).astype(int)
    corner = np.stack(np.meshgrid(*(np.arange(n) for n in cells), indexing="ij"), axis=-1).reshape(-1, 3)
    places = low + size * (corner + np.random.default_rng(4).random(corner.shape)) / cells
    return float(np.prod(size)) * float((winding_numbers(places, points, triangles) > 0.5).mean())


def _solid_angle(point: Array, corners: Array) -> float:
    """Solid angle of triangles, shape [m, 3, 3], at a point."""
    a, b, c = (corners[:, k] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    det = np.einsum("ij,ij->i", a, np.cross(b, c))
    rest = (
        la * lb * lc
        + np.einsum("ij,ij->i", a, b) * lc
        + np.einsum("ij,ij->i", b, c) * la
        + np.einsum("ij,ij->i", c, a) * lb
    )
    return float(2.0 * np.arctan2(det, rest).sum())
