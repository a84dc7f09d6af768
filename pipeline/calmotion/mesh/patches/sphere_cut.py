"""Tetrahedra cut along the line in which a sphere meets their surface.

An interface patch is the part of a surface within a sphere. A patch of whole elements ends up to an element too early
or too late, by another distance for each mesh; after the cut its rim is a line of edges.
"""

import numpy as np

from calmotion.arrays import Array, BoolArray, Indices, IntArray
from calmotion.mesh.surfaces.distances import closest_on_triangles, triangle_parts
from calmotion.mesh.surfaces.nearby_triangles import unit_normals
from calmotion.mesh.tetrahedra import boundary_triangles, corner_keys, part_of_each, tet_volumes

ON = 1e-9  # of the radius: distance from the sphere of points on it
_NEAR = 0.3  # part of an edge within which its end moves onto the sphere, instead of a new point
_LEAST = 0.05  # part of an edge that is cut off at least: an end that is nearer and cannot move counts as on the sphere
_LIFT = 0.02  # of the edge: how far a corner that moves may leave a triangle around it
_FLAT = 0.3  # least part of its volume that a tetrahedron keeps where a corner moves
_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
_ROUNDS = 50


def cut(
    points: Array, tets: IntArray, center: Array, radius: float, fixed: BoolArray | None = None
) -> tuple[Array, IntArray]:
    """Tetrahedra of which each triangle of the surface is inside a sphere, or outside.

    Corners near the sphere move onto it along edges of the surface, where this leaves the surface as it is; other edges
    of the surface are divided where they meet the sphere.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], positive volumes.
        center: [m], shape [3].
        radius: [m].
        fixed: Which points do not move, such as those on a line along which the mesh was cut before, shape [n].

    Returns:
        Points, of which the first n are the given ones, moved where needed, and tetrahedra with positive volumes.
    """
    points = _moved_onto(points, tets, center, radius, np.zeros(len(points), dtype=bool) if fixed is None else fixed)
    for _ in range(_ROUNDS):
        ends, part = _crossing(points, tets, center, radius)
        far = (part > _LEAST) & (part < 1.0 - _LEAST)
        ends, part = ends[far], part[far]
        if not len(ends):
            break
        points, tets = _divided(points, tets, ends, part)
    return points, tets


def inside(corners: Array, center: Array, radius: float) -> BoolArray:
    """Which triangles of a surface that was cut are within the sphere, shape [k].

    Args:
        corners: [m], shape [k, 3, 3].
    """
    far = np.linalg.norm(corners - center, axis=2).max(axis=1)
    edge = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1)
    # where the sphere grazes the surface, a corner so far from it may be far along the surface
    middle = np.linalg.norm(corners.mean(axis=1) - center, axis=1)
    return np.asarray((far <= radius * (1.0 + ON) + 1.5 * _LEAST * edge) & (middle <= radius * (1.0 + ON)))


def _crossing(points: Array, tets: IntArray, center: Array, radius: float) -> tuple[IntArray, Array]:
    """Edges of the surface that cross the sphere, from inside to outside, shape [k, 2], and where, shape [k]."""
    distance = np.linalg.norm(points - center, axis=1) - radius
    side = np.where(np.abs(distance) <= ON * radius, 0.0, np.sign(distance))
    # all elements with a triangle that crosses the sphere cross it, so that no others are needed
    crossing = tets[(side[tets].min(axis=1) < 0.0) & (side[tets].max(axis=1) > 0.0)]
    triangles = boundary_triangles(crossing)
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]))
    edges = sides[np.unique(corner_keys(sides), return_index=True)[1]]
    edges = edges[side[edges[:, 0]] * side[edges[:, 1]] < 0.0]
    edges = np.where((distance[edges[:, 0]] < 0.0)[:, None], edges, edges[:, ::-1])
    start, way = points[edges[:, 0]] - center, points[edges[:, 1]] - points[edges[:, 0]]
    # |start + t way| = radius
    a, b = np.einsum("ij,ij->i", way, way), np.einsum("ij,ij->i", start, way)
    c = np.einsum("ij,ij->i", start, start) - radius**2
    return edges, np.asarray((-b + np.sqrt(b * b - a * c)) / a)


def _moved_onto(points: Array, tets: IntArray, center: Array, radius: float, fixed: BoolArray) -> Array:
    """The points, those near the sphere moved onto it along an edge where the surface stays as it is."""
    edges, part = _crossing(points, tets, center, radius)
    if not len(edges):
        return points
    ends = np.concatenate([edges[:, 0], edges[:, 1]])
    near = np.concatenate([part, 1.0 - part])
    at = points[edges[:, 0]] + part[:, None] * (points[edges[:, 1]] - points[edges[:, 0]])
    step = np.concatenate([at, at]) - points[ends]
    length = np.tile(np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1), 2)
    tets = tets[np.isin(tets, ends).any(axis=1)]  # all elements around these
    triangles = boundary_triangles(tets)
    normal = unit_normals(points[triangles])[0]
    around = [normal[(triangles == end).any(axis=1)] for end in ends]
    lift = np.array([np.abs(n @ s).max() for n, s in zip(around, step / length[:, None], strict=True)])
    volumes, moved = tet_volumes(points, tets), points.copy()
    for k in np.argsort(near, kind="stable"):
        end = ends[k]
        if fixed[end] or near[k] > _NEAR or lift[k] > _LIFT or not np.array_equal(moved[end], points[end]):
            continue
        own = (tets == end).any(axis=1)
        moved[end] += step[k]
        if (tet_volumes(moved, tets[own]) < _FLAT * volumes[own]).any():
            moved[end] = points[end]
    return moved


def _divided(points: Array, tets: IntArray, ends: IntArray, part: Array) -> tuple[Array, IntArray]:
    """Some of the edges divided, among them the longest: no two of one tetrahedron.

    Args:
        ends: Edges, shape [k, 2].
        part: Where each is divided, from its first end.
    """
    count = len(points)
    ordered = np.sort(ends, axis=1).astype(np.int64)
    key = ordered[:, 0] * count + ordered[:, 1]
    order = np.argsort(key)
    own = np.sort(tets[:, _EDGES], axis=2).astype(np.int64)
    own_key = own[..., 0] * count + own[..., 1]
    place = np.minimum(np.searchsorted(key[order], own_key), len(key) - 1)
    edge = np.where(key[order][place] == own_key, order[place], -1)  # of the list, for each edge of a tetrahedron
    way = points[ends[:, 1]] - points[ends[:, 0]]
    # by length, and by number among equals
    rank = np.empty(len(key))
    rank[np.lexsort((key, np.einsum("ij,ij->i", way, way)))] = np.arange(len(key))
    highest = np.where(edge >= 0, rank[edge], -1.0).max(axis=1)
    beaten = np.zeros(len(key), dtype=bool)
    lower = (edge >= 0) & (rank[edge] < highest[:, None])
    beaten[edge[lower]] = True
    new = np.full(len(key), -1)
    chosen = np.flatnonzero(~beaten)
    new[chosen] = count + np.arange(len(chosen))
    added = points[ends[chosen, 0]] + part[chosen, None] * way[chosen]
    hit = (edge >= 0) & (new[edge] >= 0)
    element = np.flatnonzero(hit.any(axis=1))
    local = hit[element].argmax(axis=1)
    middle = new[edge[element, local]]
    first, second = tets[element].copy(), tets[element].copy()
    rows = np.arange(len(element))
    first[rows, _EDGES[local, 1]] = middle
    second[rows, _EDGES[local, 0]] = middle
    others = np.delete(tets, element, axis=0)
    return np.concatenate([points, added]), np.concatenate([others, first, second]).astype(tets.dtype)


_ON = 1e-9  # of the radius: triangles that end on the sphere
# Nearest place of a part, from the nearest of all (0) to the sphere (1). On nine robots, second cheeks and the sides
# of bores are at most at 0.7, walls that a sphere just reaches mostly at 0.9 and more.
_FARTHEST = 0.75
# Of the angle about an axis, and how many of them what is around it covers; share of the area within the sphere that is
# around it, from which the axis decides; and the distance from it, of the radius, of what it does not hold then. On
# seven robots bottoms of forks cover 1 to 4 sectors and are at 0.8 to 0.95.
_SECTORS, _COVERED, _MOSTLY, _AWAY = 16, 12, 0.5, 0.75
_PARTS = triangle_parts(8)


def just_reached(
    points: Array, triangles: Indices, center: Array, radius: float, axis: Array | None = None, beyond: float = _ON
) -> BoolArray:
    """Triangles of parts that a sphere just reaches, and that a joint in its center does not hold, shape [k].

    Args:
        points: Of the surface [m], shape [n, 3].
        triangles: Shape [k, 3].
        center: [m], shape [3].
        radius: [m].
        axis: Of the joint, unit vector, shape [3]; None: it is not known.
        beyond: Of the radius: how far outside the sphere triangles may begin that belong to parts; infinite: all do, as
            where only those within a sphere are given, some of which a cut left a little outside.
    """
    corners = points[triangles]
    gaps = np.linalg.norm(closest_on_triangles(center, corners) - center, axis=1)
    reached = np.flatnonzero(gaps <= radius * (1.0 + beyond))
    found = np.zeros(len(triangles), dtype=bool)
    if not len(reached):
        return found
    part = part_of_each(triangles[reached])
    nearest = np.full(part.max() + 1, np.inf)
    np.minimum.at(nearest, part, gaps[reached])
    least = float(nearest.min())
    far = np.asarray(nearest > least + _FARTHEST * (radius - least))
    if axis is not None and len(nearest) > 1:
        far |= _beside(corners[reached] - center, part, radius, axis)
    found[reached[far[part]]] = True
    return found


def _beside(corners: Array, part: Indices, radius: float, axis: Array) -> BoolArray:
    """Which parts within a sphere are on one side of an axis through its center, far from it, while others are around.

    Args:
        corners: Of triangles [m], shape [k, 3, 3], from the center.
        part: Of each triangle, shape [k].
        radius: [m].
        axis: Unit vector, shape [3].
    """
    at = np.einsum("pk,tkx->tpx", _PARTS, corners)
    within = np.linalg.norm(at, axis=2) <= radius
    double = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    across = np.linalg.svd(axis[None])[2][1:]
    x, y = np.moveaxis(at @ across.T, 2, 0)
    sector = np.floor((np.arctan2(y, x) + np.pi) / (2.0 * np.pi) * _SECTORS).astype(int).clip(0, _SECTORS - 1)
    count = int(part.max()) + 1
    of = np.broadcast_to(part[:, None], within.shape)[within]
    covered = np.zeros((count, _SECTORS), dtype=bool)
    covered[of, sector[within]] = True
    area, away = np.zeros(count), np.full(count, np.inf)
    np.add.at(area, of, np.broadcast_to(double[:, None], within.shape)[within])
    np.minimum.at(away, of, np.hypot(x, y)[within])
    around = covered.sum(axis=1) >= _COVERED
    if area[around].sum() < _MOSTLY * area.sum():
        return np.zeros(count, dtype=bool)
    return np.asarray(~around & (away >= _AWAY * radius) & np.isfinite(away))
