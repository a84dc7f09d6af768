"""Volume, centroid and second moments of solids, and mass properties from them. NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, Indices, IntArray
from calmotion.model import MassProperties


@dataclass(frozen=True, eq=False)
class Moments:
    """Integrals of a solid.

    Attributes:
        volume: Its volume.
        center: Its centroid, shape [3].
        second: Integral of (x - center)(x - center)^T, shape [3, 3].
    """

    volume: float
    center: Array
    second: Array

    def mapped(self, linear: Array, offset: Array) -> Moments:
        """The moments of the solid under x -> linear x + offset; exact."""
        stretch = abs(float(np.linalg.det(linear)))
        return Moments(
            self.volume * stretch,
            linear @ self.center + offset,
            stretch * linear @ self.second @ linear.T,
        )

    def mass_properties(self, density: float) -> MassProperties:
        """With a uniform density."""
        second = density * self.second
        return MassProperties(density * self.volume, self.center, np.trace(second) * np.eye(3) - second)


def tetrahedron_moments(corners: Array, weights: Array | None = None) -> Moments:
    """Moments of a set of tetrahedra.

    Args:
        corners: Shape [n, 4, 3].
        weights: In place of their volumes, which are signed by their orientation, shape [n].

    Source: integral of x x^T over a simplex, V/20 (sum_i x_i x_i^T + s s^T), s the sum of its corners.
    """
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0 if weights is None else weights
    total = float(volumes.sum())
    if total == 0.0:
        return Moments(0.0, np.zeros(3), np.zeros((3, 3)))
    sums = corners.sum(axis=1)
    center = volumes @ sums / (4.0 * total)
    local = corners - center  # about the centroid at once: no cancellation far from the origin
    sums = local.sum(axis=1)
    second = np.einsum("n,nia,nib->ab", volumes, local, local) + np.einsum("n,na,nb->ab", volumes, sums, sums)
    return Moments(total, center, second / 20.0)


def surface_moments(points: Array, triangles: Indices) -> Moments:
    """Moments of the solid within a closed triangulated surface; an inward surface is turned outward.

    Args:
        points: Shape [n, 3].
        triangles: Shape [m, 3].
    """
    corners = np.empty((len(triangles), 4, 3))
    corners[:, 0] = points.mean(axis=0)
    corners[:, 1:] = points[triangles]
    moments = tetrahedron_moments(corners)
    if moments.volume < 0.0:
        return Moments(-moments.volume, moments.center, -moments.second)
    return moments


def is_closed(triangles: IntArray, points: Array) -> bool:
    """Whether every edge is met by two triangles in opposite directions, points at one place counting as one."""
    _, same = np.unique(points, axis=0, return_inverse=True)
    merged = same.reshape(-1)[triangles]
    merged = merged[(merged[:, 0] != merged[:, 1]) & (merged[:, 1] != merged[:, 2]) & (merged[:, 2] != merged[:, 0])]
    if len(merged) == 0:
        return False
    edges = np.concatenate([merged[:, [0, 1]], merged[:, [1, 2]], merged[:, [2, 0]]]).astype(np.int64)
    count = int(edges.max()) + 1
    forward = np.sort(edges[:, 0] * count + edges[:, 1])
    backward = np.sort(edges[:, 1] * count + edges[:, 0])
    return bool(np.array_equal(forward, backward))


def sum_of(parts: list[MassProperties]) -> MassProperties:
    """The mass properties of several solids together."""
    mass = sum(part.mass for part in parts)
    center = sum((part.mass * part.center for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        d = part.center - center
        inertia += part.inertia + part.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return MassProperties(mass, center, inertia)
