"""Where a joint takes hold of a body whose surface its attachment frame does not touch.

A frame may be at the joint's place in a neighbour, in the middle of a bearing, or behind a flange. What holds the joint
is then the nearest part of the surface that goes around its axis: a bore or a boss, as of a bearing or a servo horn,
or a flange. Without one, it is the nearest place of the surface.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from calmotion.arrays import Array, BoolArray, box_diagonal
from calmotion.mesh.surfaces.distances import closest_on_triangles, triangle_parts

LARGEST_GAP = 0.5  # of the size of a body, between its surface and a frame inside its convex hull that touches it
OUTSIDE = 0.05  # of the size, by which a frame inside the hull may be outside it
_ALONG, _ACROSS = np.cos(np.radians(15.0)), np.sin(np.radians(15.0))  # of normals along and across the axis
_SECTORS, _COVERED = 16, 12  # of the angle around the axis, and how many a ring or flange covers
_BIN = 0.02  # of the size: rings of one radius, flanges in one plane
_FEW = 5_000  # triangles, below which a triangle may be long
_FARTHER, _ASIDE = 1.5, 0.1  # a ring may be farther than the nearest place, by a factor and a part of the size


@dataclass(frozen=True, eq=False)
class ContactPlace:
    """Where a joint takes hold of a body.

    Attributes:
        position: Where an attachment frame would touch the body [m], shape [3]; on the axis of a ring or flange.
        kind: `ring`, `flange` or `face`.
        distance: From the attachment frame to the surface [m].
    """

    position: Array
    kind: str
    distance: float


def contact_place(center: Array, axis: Array, triangles: Array, points: Array) -> ContactPlace | None:
    """The contact place of an attachment frame; None where the frame itself touches the body.

    Args:
        center: Origin of the attachment frame [m], shape [3].
        axis: Of the joint, unit vector, shape [3].
        triangles: Surface [m], shape [k, 3, 3], outward.
        points: Whose convex hull is that of the body [m], shape [n, 3].
    """
    size = box_diagonal(points)
    closest = closest_on_triangles(center, triangles)
    gaps = np.linalg.norm(closest - center, axis=1)
    gap = float(gaps.min())
    inside = gap <= OUTSIDE * size or inside_hull(points, center, OUTSIDE * size)
    if inside and gap <= LARGEST_GAP * size:
        return None
    x, normal = _places(triangles)
    away = x - center
    height = away @ axis
    radial = away - height[:, None] * axis
    radius = np.linalg.norm(radial, axis=1)
    outward = np.einsum("ij,ij->i", radial, normal) / np.maximum(radius, np.finfo(float).tiny)
    sector = _sectors(radial, axis)
    limit = _FARTHER * gap + _ASIDE * size
    along = np.abs(normal @ axis)
    ring = (along < _ACROSS) & (np.abs(outward) > _ALONG)
    level = _nearest_level(radius, ring, sector, np.hypot(radius, height), limit, _BIN * size)
    if level is not None:
        band = height[ring & (np.abs(radius - level) <= _BIN * size)]
        return ContactPlace(center + _at(band, level) * axis, "ring", gap)
    flange = along > _ALONG
    level = _nearest_level(height, flange, sector, np.hypot(radius, height), limit, _BIN * size)
    if level is not None:
        return ContactPlace(center + level * axis, "flange", gap)
    return ContactPlace(np.asarray(closest[int(gaps.argmin())]), "face", gap)


def inside_hull(points: Array, place: Array, margin: float) -> bool:
    """Whether a place is in the convex hull of points, or outside by no more than the margin [m]."""
    try:
        equations = ConvexHull(points).equations
    except QhullError:  # flat
        return False
    return bool((equations[:, :3] @ place + equations[:, 3]).max() <= margin)


def _places(triangles: Array) -> tuple[Array, Array]:
    """Places on a surface, several on each triangle, and the unit normals there, both of shape [n, 3]."""
    parts = triangle_parts(6 if len(triangles) <= _FEW else 2)
    x = np.einsum("pk,tkx->tpx", parts, triangles).reshape(-1, 3)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    return x, np.repeat(normal, len(parts), axis=0)


def _sectors(radial: Array, axis: Array) -> Array:
    across = np.linalg.svd(axis[None])[2][1:]
    angle = np.arctan2(radial @ across[1], radial @ across[0])
    return np.asarray(np.minimum((angle + np.pi) / (2.0 * np.pi) * _SECTORS, _SECTORS - 1).astype(int))


def _nearest_level(
    values: Array, chosen: BoolArray, sector: Array, distance: Array, limit: float, width: float
) -> float | None:
    """The radius of the nearest ring, or the height of the nearest flange, that goes around the axis."""
    best, nearest = None, limit
    for k in np.unique(np.round(values[chosen] / width)):
        band = chosen & (np.abs(values - k * width) <= 0.75 * width)
        least = float(distance[band].min())
        if least < nearest and len(np.unique(sector[band])) >= _COVERED:
            best, nearest = float(np.median(values[band])), least
    return best


def _at(heights: Array, radius: float) -> float:
    """Height of the contact on a ring: as deep as it is wide, from its nearer end, at most in its middle."""
    low, high = float(heights.min()), float(heights.max())
    depth = min(radius, 0.5 * (high - low))
    return float(np.clip(0.0, low + depth, high - depth))
