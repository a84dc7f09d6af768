"""Cross sections of a closed triangulated surface by planes across an axis: how large, where, and how full they are."""

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
        area: [m^2], shape [n]; 0 where the plane meets nothing.
        centroid: [m], shape [n, 3], axes of the points; the axis itself where the plane meets nothing.
        second: Principal second moments of area about the centroid, ascending [m^4], shape [n, 2].
        extent: Sides of the bounding box in the principal axes [m], shape [n, 2]: along the axis of the smaller
            second moment's bending, so that a rectangle has its thickness first.
        outline: Length of all outlines, of holes as well [m], shape [n].
    """

    stations: Array
    area: Array
    centroid: Array
    second: Array
    extent: Array
    outline: Array

    @property
    def fill(self) -> Array:
        """Area over that of the bounding box, shape [n]: 1 for a rectangle, pi/4 for an ellipse, little for a tube."""
        return self.area / np.maximum(self.extent.prod(axis=1), np.finfo(float).tiny)

    @property
    def compactness(self) -> Array:
        """Area over that of the circle with the same outline, shape [n]: 1 for a circle, little for thin walls."""
        return 4.0 * np.pi * self.area / np.maximum(self.outline**2, np.finfo(float).tiny)

    @property
    def depth(self) -> Array:
        """Twice the area over the outline [m], shape [n]: of a thin wall its thickness, of a square half its side."""
        return 2.0 * self.area / np.maximum(self.outline, np.finfo(float).tiny)


def cross_sections(points: Array, triangles: Indices, origin: Array, axis: Array, stations: Array) -> Sections:
    """Sections by the planes across an axis.

    A corner in a plane counts as below it, so that the section is the one just beyond, outlines always close, and
    faces within the plane do not matter.

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

    # about the middle of each outline, so that one far from the axis loses no digits
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
    """The segments that bound sections, anticlockwise around material, seen against the axis.

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
    # an outward face is left along its falling edge and entered along its rising one
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
