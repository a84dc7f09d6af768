"""Size of an interface patch that is not authored: the end face below the attachment frame, else a measured radius."""

from typing import Protocol

import numpy as np

from calmotion.arrays import Array, Indices, IntArray, box_diagonal
from calmotion.mesh.patches.sphere_cut import just_reached
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.mesh.surfaces.distances import closest_on_triangles, meets_plane, ray_length, triangle_parts
from calmotion.mesh.tetrahedra import part_of_each

_ASIDE = 0.01  # of the body's size: distance from the attachment frame of the other measurements of the width
_DIRECTIONS = 16  # rays across the body that measure its width
_FLAT_COSINE = np.cos(np.radians(10.0))  # a tetrahedraliser may tilt the triangles of a plane by a few degrees
_SECTORS, _COVERED = 16, 12  # of the angle around an opening, and how many its end face covers
_FLAT_OFFSET = 3e-3  # and move its corners by about a thousandth of the body
_LEAST_FACE = 0.2  # of the half width of the body below: a smaller flat is the ground of a recess or the tip of a screw
# Of the least radius: of that at which a rigid disc on a half space turns as easily as a bar of the body's volume and
# length bends, and of the body's size
_LEAST_RADIUS, _LEAST_PART = 0.5, 0.05
_POISSON = 0.35
ROOM = 0.45  # of the distance to the next attachment frame: largest radius, which leaves some of the surface between


_PARTS = triangle_parts(6)


class Skin(Protocol):
    """A surface: points [m], shape [n, 3], and triangles, shape [k, 3 or more], corners first."""

    @property
    def nodes(self) -> Array: ...
    @property
    def surface(self) -> Indices: ...


def end_face(mesh: Skin, center: Array, triangles: Array, closest: Array, gaps: Array, room: float) -> IntArray:
    """Nodes of the flat end face on which an attachment frame lies; empty where there is none.

    A joint in the middle of the end of a link is attached to the whole end, as a flange is, and not to the sides: this
    is the clamped beam of the text books. A face is an end face when the body behind it is deeper than the face is
    wide, both measured from the attachment frame, and not much wider than the face. The end of a tube around the frame
    is one as well.

    Args:
        mesh: Of the body, or its surface.
        center: Origin of the attachment frame [m], shape [3].
        triangles: Surface [m], shape [k, 3, 3], outward, in the order of `mesh.surface`.
        closest, gaps: Closest point of each triangle to the center [m], shape [k, 3], and its distance, shape [k].
        room: Distance to the next attachment frame [m].
    """
    none = np.zeros(0, dtype=np.int32)
    size = box_diagonal(mesh.nodes)
    nearest = int(gaps.argmin())
    if gaps[nearest] > _FLAT_OFFSET * size:
        return _end_ring(mesh, center, triangles, size, room)
    normal = _touched_normal(triangles, gaps, size)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    off_plane = np.abs((triangles - center) @ normal).max(axis=1)
    flat = np.flatnonzero((normals @ normal > _FLAT_COSINE) & (off_plane <= _FLAT_OFFSET * size))
    if nearest not in flat:
        return none
    label = part_of_each(mesh.surface[flat, :3])
    face = flat[label == label[np.searchsorted(flat, nearest)]]
    extent = float(np.linalg.norm(triangles[face] - center, axis=-1).max())
    depth = _depth(closest[nearest], normal, triangles, size)
    if extent > min(0.5 * depth, room) or extent < _LEAST_FACE * _width_at(closest, gaps, triangles, size):
        return none
    return np.unique(mesh.surface[face])


def _end_ring(mesh: Skin, center: Array, triangles: Array, size: float, room: float) -> IntArray:
    """Nodes of the flat end of a tube, around an attachment frame in the middle of its opening; empty without one."""
    none = np.zeros(0, dtype=np.int32)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normals, axis=1)
    normals /= np.maximum(area[:, None], np.finfo(float).tiny)
    away = triangles - center
    through = np.abs(np.einsum("kij,kj->ki", away, normals)).max(axis=1) <= _FLAT_OFFSET * size
    if not through.any():
        return none
    normal = normals[through][int(area[through].argmax())]
    ring = np.flatnonzero(through & (normals @ normal > _FLAT_COSINE))
    middle = away[ring].mean(axis=1)
    u, v = np.linalg.svd(normal[None])[2][1:]
    sectors = np.floor((np.arctan2(middle @ v, middle @ u) + np.pi) / (2.0 * np.pi) * _SECTORS)
    extent = float(np.linalg.norm(away[ring], axis=-1).max())
    depth = _depth(triangles[ring[0]].mean(axis=0), normal, triangles, size)
    if len(np.unique(sectors)) < _COVERED or extent > min(0.5 * depth, room):
        return none
    return np.unique(mesh.surface[ring])


def automatic_radius(center: Array, triangles: Array, closest: Array, gaps: Array, room: float) -> float:
    """Radius of an interface patch that carries the joint and does not stiffen the rest of the body [m].

    An attachment frame on the surface gets the local half width of the body: the narrowest half width w across (rays
    in planes parallel to the surface) at the first depth d with w <= 2 d, or the whole depth of a plate. An attachment
    frame away from the surface (on the axis of a bore, inside a socket) gets a band of that height around it. The
    radius is at most `ROOM` of the distance to the next attachment frame.

    Args:
        center: Origin of the attachment frame [m], shape [3].
        triangles: Surface [m], shape [k, 3, 3], outward.
        closest, gaps: Closest point of each triangle to the center [m], shape [k, 3], and its distance, shape [k].
        room: Distance to the next attachment frame [m].
    """
    gap = float(gaps.min())
    size = box_diagonal(triangles)
    # A ray may just hit or just miss an edge: the median of several places does not depend on one ray.
    widths = [_width_at(closest, gaps, triangles, size)]
    for step in _ASIDE * size * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0):
        near = closest_on_triangles(center + step, triangles)
        widths.append(_width_at(near, np.linalg.norm(near - center - step, axis=1), triangles, size))
    finite = [width for width in widths if np.isfinite(width)]
    width = float(np.median(finite)) if finite else 0.5 * size
    radius = max(1.25 * gap, float(np.hypot(gap, width)), least_radius(triangles))
    return min(radius, max(ROOM * room, 1.25 * gap))


def least_radius(triangles: Array) -> float:
    """Radius below which a patch, not the body, would decide how far the body bends [m].

    A patch that is nearly a point turns on its ground: its compliance goes with the third power of one over its radius.
    At half the radius at which that is the compliance of the body itself, it is eight times as large.

    Args:
        triangles: Surface [m], shape [k, 3, 3], outward.
    """
    size = box_diagonal(triangles)
    return min(_LEAST_RADIUS * radius_alike(triangles), _LEAST_PART * size)


def radius_alike(triangles: Array) -> float:
    """Radius at which a patch turns on its ground as easily as the body bends [m].

    Args:
        triangles: Surface [m], shape [k, 3, 3], outward.

    Source: Johnson 1985, 3.6, a rigid disc on a half space under a moment: 8 G a^3 / (3 (1 - nu)); a bar: E I / L.
    """
    volume = abs(float(np.linalg.det(triangles).sum())) / 6.0
    length = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    bar = 2.0 * (1.0 + _POISSON) * volume**2 / (12.0 * length**3)  # over G; a square section of the mean area
    return float((3.0 / 8.0 * (1.0 - _POISSON) * bar) ** (1.0 / 3.0))


def _width_at(closest: Array, gaps: Array, triangles: Array, size: float) -> float:
    """Half width of the body below the nearest point of the surface, or its depth on a plate [m]; NaN where a ray
    inward leaves through a gap of the surface."""
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


def nodes_of_area(
    mesh: QuadraticMesh, candidates: IntArray, center: Array, radius: float, axis: Array, given: bool = False
) -> IntArray:
    """The nearest surface nodes whose share of the surface is the area inside a sphere about a center.

    All nodes inside the sphere would make a patch up to one element larger or smaller, depending on the mesh, and so
    would change the stiffness of the body.

    Args:
        candidates: Surface nodes to choose from.
        center: [m], shape [3].
        radius: [m].
        axis: Of the joint, unit vector, shape [3].
        given: Whether the radius is given: then all of the surface inside counts, else not what it just reaches.
    """
    corners = mesh.nodes[mesh.surface[:, :3]]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # the share of each triangle that is inside, from the centers of its parts
    share = np.mean(np.linalg.norm(np.einsum("pk,tkx->tpx", _PARTS, corners) - center, axis=-1) <= radius, axis=1)
    if not given:
        left = just_reached(mesh.nodes, mesh.surface[:, :3], center, radius, axis)
        share[left] = 0.0
        candidates = np.setdiff1d(candidates, mesh.surface[left])
    wanted = float(area @ share)
    # lumped area of a quadratic triangle: a third at each midpoint, nothing at the corners
    weight = np.zeros(len(mesh.nodes))
    np.add.at(weight, mesh.surface[:, 3:], area[:, None] / 3.0)
    order = candidates[np.argsort(np.linalg.norm(mesh.nodes[candidates] - center, axis=1), kind="stable")]
    covered = np.cumsum(weight[order])
    # a node belongs to the patch when more than half of its area does
    return np.sort(order[covered - 0.5 * weight[order] <= wanted])


def _half_width(start: Array, across: Array, triangles: Array) -> float:
    triangles = triangles[meets_plane(triangles, start, np.cross(across[0], across[1]))]  # that rays across can hit
    angles = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1) @ across
    lengths = np.array([ray_length(start, ray, triangles, 0.0) for ray in rays])
    # opposite rays together: at an edge the body has no width on one side
    return 0.5 * float(lengths.reshape(2, -1).sum(axis=0).min())


def _touched_normal(triangles: Array, gaps: Array, size: float) -> Array:
    """Outward unit normal at the nearest point of the surface, the area-weighted mean of the triangles there."""
    touched = triangles[gaps <= gaps.min() + 1e-9 * size]
    normal = np.cross(touched[:, 1] - touched[:, 0], touched[:, 2] - touched[:, 0]).sum(axis=0)
    return np.asarray(normal / max(float(np.linalg.norm(normal)), np.finfo(float).tiny))


def _depth(surface: Array, normal: Array, triangles: Array, size: float) -> float:
    """Depth of the body inward from a point of its surface [m]."""
    depth = ray_length(surface, -normal, triangles, 1e-6 * size)
    return depth if np.isfinite(depth) else size
