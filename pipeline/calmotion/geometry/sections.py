"""Cross sections of a closed triangulated surface by planes normal to an axis: area, moments, extent, outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.geometry.tetrahedra import Indices
from calmotion.shot.character import Array


@dataclass(frozen=True, eq=False)
class Sections:
    """Plane sections, at n stations along an axis.

    Attributes:
        stations: Distance along the axis from its origin [m], shape [n].
        area: [m^2], shape [n]; 0 where the plane does not intersect the surface.
        centroid: [m], shape [n, 3], axes of the points; on the axis where the plane does not intersect the surface.
        second: Principal second moments of area about the centroid, ascending [m^4], shape [n, 2].
        extent: Sides of the bounding box in the principal axes [m], shape [n, 2]: along the axis of the smaller
            second moment's bending, so that a rectangle has its thickness first.
        outline: Length of all outlines, including those of holes [m], shape [n].
    """

    stations: Array
    area: Array
    centroid: Array
    second: Array
    extent: Array
    outline: Array

    @property
    def fill(self) -> Array:
        """Area over that of the bounding box, shape [n]: 1 for a rectangle, pi/4 for an ellipse, small for a tube."""
        return np.asarray(self.area / np.maximum(self.extent.prod(axis=1), np.finfo(float).tiny))

    @property
    def compactness(self) -> Array:
        """Area over that of the circle with the same outline, shape [n]: 1 for a circle, small for thin walls."""
        return 4.0 * np.pi * self.area / np.maximum(self.outline**2, np.finfo(float).tiny)

    @property
    def depth(self) -> Array:
        """Twice the area over the outline [m], shape [n]: the thickness of a thin wall, half the side of a square."""
        return 2.0 * self.area / np.maximum(self.outline, np.finfo(float).tiny)


def cross_sections(points: Array, triangles: Indices, origin: Array, axis: Array, stations: Array) -> Sections:
    """Sections by planes normal to an axis.

    A corner in a plane counts as below it. The section is therefore the one just above the plane, all outlines are
    closed, and faces in the plane have no effect.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3], closed, outward; those of cavities inward.
        origin: Of the axis [m], shape [3].
        axis: Its unit direction, shape [3].
        stations: Distances from the origin [m], shape [k], ascending.

    Source: Green's theorem, over the triangles that the outline's segments make with one point.
    """
    count = len(stations)
    frame = _frame_along(axis)
    which, start, end = outlines(points, triangles, origin, axis, stations)

    def total(values: Array) -> Array:
        return np.bincount(which, values, minlength=count).astype(float)

    # about the center of each outline, against cancellation far from the axis
    corners = np.maximum(total(np.ones(len(which))), 1.0)
    middle = np.stack([total(start[:, k]) / corners for k in range(2)], axis=1)
    p, q = start - middle[which], end - middle[which]
    double = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    area = 0.5 * total(double)
    safe = np.where(area > 0.0, area, 1.0)[:, None]
    center = np.stack([total(double * (p + q)[:, k]) / 6.0 for k in range(2)], axis=1) / safe
    second = np.zeros((count, 2, 2))
    for a, b in ((0, 0), (0, 1), (1, 1)):
        products = p[:, a] * p[:, b] + q[:, a] * q[:, b] + (p + q)[:, a] * (p + q)[:, b]
        second[:, a, b] = second[:, b, a] = total(double * products) / 24.0
    second -= area[:, None, None] * center[:, :, None] * center[:, None, :]
    principal, axes = np.linalg.eigh(second)
    across = np.einsum("sa,sab->sb", p, axes[which])
    high, low = np.full((count, 2), -np.inf), np.full((count, 2), np.inf)
    np.maximum.at(high, which, across)
    np.minimum.at(low, which, across)
    return Sections(
        stations=stations,
        area=area,
        centroid=origin + np.column_stack([middle + center, stations]) @ frame,
        second=np.maximum(principal, 0.0),
        extent=np.where(high > low, high - low, 0.0),
        outline=total(np.linalg.norm(q - p, axis=1)),
    )


def outlines(
    points: Array, triangles: Indices, origin: Array, axis: Array, stations: Array
) -> tuple[Indices, Array, Array]:
    """The segments that bound sections, anticlockwise around the material, seen against the axis.

    Args:
        points, triangles, origin, axis, stations: As of `cross_sections`.

    Returns:
        Station of each of the s segments, its start and its end from the axis [m], shape [s, 2].
    """
    corners = ((points - origin) @ _frame_along(axis).T)[triangles]
    height = corners[:, :, 2]
    first = np.searchsorted(stations, height.min(axis=1))
    number = np.searchsorted(stations, height.max(axis=1)) - first
    triangle = np.repeat(np.arange(len(corners)), number)
    which = np.arange(len(triangle)) - np.repeat(np.cumsum(number) - number, number) + first[triangle]
    level = stations[which]
    above = height[triangle] > level[:, None]
    after = np.roll(above, -1, axis=1)
    ends = []
    # the outline leaves an outward face at its descending edge and enters it at its ascending edge
    for crossing in (above & ~after, ~above & after):
        edge = crossing.argmax(axis=1)
        a, b = corners[triangle, edge], corners[triangle, (edge + 1) % 3]
        part = (level - a[:, 2]) / (b[:, 2] - a[:, 2])
        ends.append(a[:, :2] + part[:, None] * (b - a)[:, :2])
    return which, ends[0], ends[1]


def _frame_along(axis: Array) -> Array:
    """Right-handed orthonormal rows, shape [3, 3], the last of which is the axis."""
    first = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis])
