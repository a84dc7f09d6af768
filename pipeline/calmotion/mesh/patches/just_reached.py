"""Which parts of the surface within the sphere of an interface patch a joint does not hold.

A sphere that is as large as what is next to a joint may also end on another wall: the bottom of a fork whose cheeks
carry a pin, or the other side of a shell. How much of that wall is within the sphere is chance, and depends on a
thousandth of the radius: holding it, a fork of the G1 had 320, 346 or 307 Hz on three meshes, in place of 207 Hz.

The axis of a joint tells more. What holds it is around its axis: cheeks, bores and flanges are; the bottom of a fork is
on one side.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, BoolArray, Indices
from calmotion.mesh.surfaces.distances import closest_on_triangles, triangle_parts
from calmotion.mesh.tetrahedra import part_of_each

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
