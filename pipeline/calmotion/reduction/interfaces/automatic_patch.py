"""How much of a body a joint holds when nobody says: the end face that it sits on, else a measured radius."""

from __future__ import annotations

import numpy as np

from calmotion.geometry.distances import closest_on_triangles, ray_length
from calmotion.reduction.elements.assembly import QuadraticMesh
from calmotion.shot.character import Array, IntArray

_ASIDE = 0.01  # of the body's size: how far from the anchor the width is measured again
_DIRECTIONS = 16  # rays across the body that find its width at an anchor
_FLAT_COSINE = np.cos(np.radians(10.0))  # a tetrahedraliser may tilt the triangles of a plane by a few degrees
_FLAT_OFFSET = 3e-3  # and move its corners by about a thousandth of the body


def _triangle_parts(count: int) -> Array:
    """Barycentric coordinates of the middles of count^2 equal parts of a triangle, shape [count^2, 3]."""
    points = []
    for i in range(count):
        for j in range(count - i):
            points.append((i + 1 / 3, j + 1 / 3))
            if i + j < count - 1:
                points.append((i + 2 / 3, j + 2 / 3))
    first = np.array(points) / count
    return np.column_stack([first, 1.0 - first.sum(axis=1)])


_PARTS = _triangle_parts(6)


def end_face(
    mesh: QuadraticMesh, center: Array, triangles: Array, closest: Array, gaps: Array, room: float
) -> IntArray:
    """Nodes of the flat end face that an anchor lies on; empty where there is none.

    A joint in the middle of the end of a link holds all of that end, as a flange does, and nothing of its sides:
    this is the clamped beam of the text books. A face is an end when the body is deeper behind it than the face is
    wide, measured from the anchor.

    Args:
        mesh: Of the body.
        center: Anchor [m], shape [3].
        triangles: Surface [m], shape [k, 3, 3], outward, in the order of `mesh.surface`.
        closest, gaps: Closest point of each triangle to the anchor [m], shape [k, 3], and its distance, shape [k].
        room: Distance to the next anchor [m].
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    none = np.zeros(0, dtype=np.int32)
    size = float(np.linalg.norm(np.ptp(mesh.nodes, axis=0)))
    nearest = int(gaps.argmin())
    if gaps[nearest] > _FLAT_OFFSET * size:
        return none
    normal = _touched_normal(triangles, gaps, size)
    own = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    own /= np.maximum(np.linalg.norm(own, axis=1, keepdims=True), np.finfo(float).tiny)
    off_plane = np.abs((triangles - center) @ normal).max(axis=1)
    flat = np.flatnonzero((own @ normal > _FLAT_COSINE) & (off_plane <= _FLAT_OFFSET * size))
    if nearest not in flat:
        return none
    corners = mesh.surface[flat, :3]
    links = (np.repeat(np.arange(len(flat)), 3), corners.ravel())
    graph = coo_matrix((np.ones(len(links[0])), links), shape=(len(flat), len(mesh.nodes)))
    label = connected_components(graph @ graph.T, directed=False)[1]
    face = flat[label == label[np.searchsorted(flat, nearest)]]
    extent = float(np.linalg.norm(triangles[face] - center, axis=-1).max())
    depth = _depth(closest[nearest], normal, triangles, size)
    if extent > min(0.5 * depth, room):
        return none
    return np.unique(mesh.surface[face])


def automatic_radius(center: Array, triangles: Array, closest: Array, gaps: Array, room: float) -> float:
    """A radius that holds the body at an anchor without stiffening what is beside it [m].

    On the surface it is the local half width of the body: going inward, the first depth d at which the narrowest
    half width w across (rays in planes parallel to the surface) is at most 2 d, or the whole depth on a plate. Off the
    surface (on the axis of a bore, inside a socket) the patch is a band of that height around the anchor. Never more
    than 0.45 of the distance to the next anchor.

    Args:
        center: Anchor [m], shape [3].
        triangles: Surface [m], shape [k, 3, 3], outward.
        closest, gaps: Closest point of each triangle to the anchor [m], shape [k, 3], and its distance, shape [k].
        room: Distance to the next anchor [m].
    """
    gap = float(gaps.min())
    size = float(np.linalg.norm(np.ptp(triangles.reshape(-1, 3), axis=0)))
    # Where a ray just meets or just misses an edge, one place says little: the middle of what several say.
    found = [_width_at(closest, gaps, triangles, size)]
    for step in _ASIDE * size * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0):
        near = closest_on_triangles(center + step, triangles)
        found.append(_width_at(near, np.linalg.norm(near - center - step, axis=1), triangles, size))
    seen = [width for width in found if np.isfinite(width)]
    width = float(np.median(seen)) if seen else 0.5 * size
    radius = max(1.25 * gap, float(np.hypot(gap, width)))
    return min(radius, max(0.45 * room, 1.25 * gap))


def _width_at(closest: Array, gaps: Array, triangles: Array, size: float) -> float:
    """Half width of the body below the nearest surface, or its depth there on a plate [m]; not a number where the
    surface has a gap below."""
    normal = _touched_normal(triangles, gaps, size)
    surface = closest[int(gaps.argmin())]
    depth = ray_length(surface, -normal, triangles, 1e-6 * size)
    if not np.isfinite(depth):
        return np.nan
    across = np.linalg.svd(normal[None])[2][1:]
    d = max(1e-3 * depth, 1e-5 * size)
    while d <= 0.5 * depth:
        half = _half_width(surface - d * normal, across, triangles)
        if half <= 2.0 * d:
            return half
        d *= 1.25
    return depth


def nodes_of_area(mesh: QuadraticMesh, own: IntArray, center: Array, radius: float) -> IntArray:
    """The nearest surface nodes to a center that stand for as much surface as a sphere about it cuts out.

    Nodes inside the sphere would make a patch that is up to an element larger or smaller, as the mesh happens to
    lie, and with it the stiffness of the body.

    Args:
        mesh: Of the body.
        own: Surface nodes to choose from.
        center: [m], shape [3].
        radius: [m].
    """
    corners = mesh.nodes[mesh.surface[:, :3]]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # each triangle by the middles of its parts
    share = np.mean(np.linalg.norm(np.einsum("pk,tkx->tpx", _PARTS, corners) - center, axis=-1) <= radius, axis=1)
    wanted = float(area @ share)
    # the midpoints of a quadratic triangle stand for its surface, a third each; its corners for none
    weight = np.zeros(len(mesh.nodes))
    np.add.at(weight, mesh.surface[:, 3:], area[:, None] / 3.0)
    order = own[np.argsort(np.linalg.norm(mesh.nodes[own] - center, axis=1), kind="stable")]
    covered = np.cumsum(weight[order])
    # a node belongs to the patch when more than half of what it stands for does
    return np.sort(order[covered - 0.5 * weight[order] <= wanted])


def _half_width(start: Array, across: Array, triangles: Array) -> float:
    angles = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1) @ across
    lengths = np.array([ray_length(start, ray, triangles, 0.0) for ray in rays])
    # opposite rays together: an anchor at an edge has no width on one side of it
    return 0.5 * float(lengths.reshape(2, -1).sum(axis=0).min())


def _touched_normal(triangles: Array, gaps: Array, size: float) -> Array:
    """Outward unit normal where the anchor is nearest, the mean by area of the triangles that meet there."""
    touched = triangles[gaps <= gaps.min() + 1e-9 * size]
    normal = np.cross(touched[:, 1] - touched[:, 0], touched[:, 2] - touched[:, 0]).sum(axis=0)
    return normal / max(float(np.linalg.norm(normal)), np.finfo(float).tiny)


def _depth(surface: Array, normal: Array, triangles: Array, size: float) -> float:
    """How far the body reaches inward from a point of its surface [m]."""
    depth = ray_length(surface, -normal, triangles, 1e-6 * size)
    return depth if np.isfinite(depth) else size
