"""Closed surfaces, all made one way: rings of points skinned from a first pole to a last one.

Lengths are metres. Every surface is watertight with outward faces, so it can be meshed, weighed and drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
AXES = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}


@dataclass(frozen=True, eq=False)
class Shape:
    """A closed polygon mesh: `points` [m], shape [n, 3]; `faces`, tuples of point indices, outward."""

    points: Array
    faces: tuple[tuple[int, ...], ...]

    def moved(self, offset: Sequence[float]) -> Shape:
        """The same shape, translated [m]."""
        return Shape(self.points + np.asarray(offset, dtype=float), self.faces)

    def turned(self, forward: tuple[float, float]) -> Shape:
        """The same shape, turned about y so that x points along (x, z), of unit length."""
        x, z = forward
        return Shape(self.points @ np.array([[x, 0.0, z], [0.0, 1.0, 0.0], [-z, 0.0, x]]), self.faces)

    def mirrored(self) -> Shape:
        """The same shape, mirrored in the plane x = 0; still outward."""
        return Shape(self.points * np.array([-1.0, 1.0, 1.0]), tuple(face[::-1] for face in self.faces))


@dataclass(frozen=True)
class Section:
    """One cross-section of a skinned shape: position along the axis and the two half-widths across it [m]."""

    along: float
    half_a: float
    half_b: float
    shift_a: float = 0.0
    shift_b: float = 0.0


def outline(count: int, squareness: float) -> Array:
    """Points of |a|^k + |b|^k = 1, counter-clockwise, shape [count, 2]; k = 2 is a circle, 8 nearly a square."""
    angle = (np.arange(count) + 0.5) * (2.0 * np.pi / count)
    cosine, sine = np.cos(angle), np.sin(angle)
    radius = (np.abs(cosine) ** squareness + np.abs(sine) ** squareness) ** (-1.0 / squareness)
    return np.column_stack([radius * cosine, radius * sine])


def skin(sections: Sequence[Section], *, axis: str = "z", sides: int = 24, squareness: float = 2.0) -> Shape:
    """Skin the sections from the first to the last and close both ends with a fan.

    Args:
        sections: In order; the surface is outward when they advance along the axis, and stays so when a later
            one goes back inside an earlier one (the inner wall of a cup).
        axis: `x`, `y` or `z`: the axis the sections are stacked along.
        sides: Points of a section.
        squareness: Exponent of the outline.
    """
    ring = outline(sides, squareness)
    local = [
        [s.shift_a + s.half_a * ring[:, 0], s.shift_b + s.half_b * ring[:, 1], np.full(sides, s.along)]
        for s in sections
    ]
    first, last = sections[0], sections[-1]
    poles = [[first.shift_a, first.shift_b, first.along], [last.shift_a, last.shift_b, last.along]]
    columns = np.vstack([*(np.column_stack(part) for part in local), np.array(poles)])
    points = np.empty_like(columns)
    points[:, list(AXES[axis])] = columns
    faces: list[tuple[int, ...]] = []
    count = len(sections)
    bottom, top = count * sides, count * sides + 1
    for k in range(sides):
        after = (k + 1) % sides
        faces.append((bottom, after, k))
        for level in range(count - 1):
            low, high = level * sides, (level + 1) * sides
            faces.append((low + k, low + after, high + after, high + k))
        faces.append((top, (count - 1) * sides + k, (count - 1) * sides + after))
    return Shape(points, tuple(faces))


def lathe(profile: Sequence[tuple[float, float]], *, axis: str = "z", sides: int = 32) -> Shape:
    """A solid of revolution of (radius, position along the axis) pairs [m]."""
    return skin([Section(along, radius, radius) for radius, along in profile], axis=axis, sides=sides)


def cylinder(radius: float, length: float, *, axis: str = "z", sides: int = 32, bevel: float = 0.003) -> Shape:
    """A bevelled cylinder about the origin [m]."""
    half = 0.5 * length
    profile = [(radius - bevel, -half), (radius, bevel - half), (radius, half - bevel), (radius - bevel, half)]
    return lathe(profile, axis=axis, sides=sides)


def ball(radius: float, *, stretch: float = 1.0, sides: int = 24, levels: int = 10) -> Shape:
    """An ellipsoid about the origin, `radius` across and `radius * stretch` along z [m]."""
    angle = np.pi * (np.arange(levels) + 0.5) / levels
    return lathe([(radius * np.sin(a), -radius * stretch * np.cos(a)) for a in angle], sides=sides)


def arc_slab(inner: float, outer: float, low: float, high: float, degrees: tuple[float, float], steps: int) -> Shape:
    """A slab bent around the z axis, as a bar counter is: radii and heights [m], angles [deg]."""
    angle = np.radians(np.linspace(*degrees, steps + 1))
    corners = [(inner, low), (outer, low), (outer, high), (inner, high)]
    points = np.array([[r * np.cos(a), r * np.sin(a), z] for a in angle for r, z in corners])
    faces: list[tuple[int, ...]] = [(0, 1, 2, 3)]
    for level in range(steps):
        low_ring, high_ring = 4 * level, 4 * (level + 1)
        for k in range(4):
            after = (k + 1) % 4
            faces.append((low_ring + after, low_ring + k, high_ring + k, high_ring + after))
    faces.append(tuple(4 * steps + k for k in (3, 2, 1, 0)))
    return Shape(points, tuple(faces))


def volume_moments(shape: Shape) -> tuple[float, Array, Array]:
    """Volume [m^3], first moment [m^4], shape [3], and second moment int x x^T [m^5], shape [3, 3]."""
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for face in shape.faces:
        for k in range(1, len(face) - 1):
            corners = shape.points[[face[0], face[k], face[k + 1]]]
            sixfold = float(np.linalg.det(corners))
            total = corners.sum(axis=0)
            volume += sixfold / 6.0
            first += sixfold / 24.0 * total
            second += sixfold / 120.0 * (corners.T @ corners + np.outer(total, total))
    return volume, first, second
