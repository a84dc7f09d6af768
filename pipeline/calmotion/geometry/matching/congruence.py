"""The motion or reflection that takes one surface to another: a left arm is mostly the mirrored right one."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from calmotion.geometry.tetrahedra import Indices, surface_area, surface_volume
from calmotion.shot.character import Array

_SAME = 1e-5  # of the size: distance of points that are the same
_EQUAL = 1e-5  # relative difference of areas and volumes that are the same
_ROUND = 1e-3  # relative difference of principal moments below which their axes are not known


@dataclass(frozen=True, eq=False)
class Isometry:
    """x -> turn x + move.

    Attributes:
        turn: Orthogonal, shape [3, 3]; its determinant is -1 for a reflection.
        move: [m], shape [3].
    """

    turn: Array
    move: Array

    @property
    def mirrors(self) -> bool:
        """Whether it is a reflection."""
        return bool(np.linalg.det(self.turn) < 0.0)

    def __call__(self, points: Array) -> Array:
        """Points [m], shape [..., 3], after it."""
        return np.asarray(points @ self.turn.T + self.move)


def isometries(points: Array, triangles: Indices, other: Array, others: Indices) -> list[Isometry]:
    """The isometries that take a surface to another one, first the identity, then motions, then reflections.

    A surface with an axis of symmetry, or whose principal moments are nearly equal, is only found where it is not
    turned.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3], closed, outward.
        other, others: The other surface; its points and triangles may have another order.
    """
    from scipy.spatial import cKDTree

    if points.shape != other.shape or triangles.shape != others.shape:
        return []
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    for measure in (surface_area, surface_volume):
        if not np.isclose(measure(points, triangles), measure(other, others), rtol=_EQUAL, atol=0.0):
            return []
    (center, moments, axes), (end, last, ends) = _principal(points, triangles), _principal(other, others)
    if np.abs(moments - last).max() > 10.0 * _EQUAL * moments.max():
        return []
    candidates = [Isometry(np.eye(3), end - center)]
    if np.diff(moments).min() > _ROUND * moments.max():
        turns = [ends @ np.diag(signs) @ axes.T for signs in product((1.0, -1.0), repeat=3)]
        turns.sort(key=lambda turn: -np.linalg.det(turn))
        candidates += [Isometry(turn, end - turn @ center) for turn in turns]
    tree = cKDTree(other)
    found: list[Isometry] = []
    for candidate in candidates:
        known = any(np.allclose(candidate.turn, kept.turn, atol=1e-4) for kept in found)
        if not known and tree.query(candidate(points))[0].max() <= _SAME * size:
            found.append(candidate)
    return found


def _principal(points: Array, triangles: Indices) -> tuple[Array, Array, Array]:
    """Center [m], principal moments [m^2], ascending, and their axes (columns) of a surface."""
    corners = points[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    weight = area / area.sum()
    middle = weight @ corners.mean(axis=1)
    away = corners - middle
    sums = away.sum(axis=1)
    second = np.einsum("k,kia,kib->ab", weight, away, away) + np.einsum("k,ka,kb->ab", weight, sums, sums)
    moments, axes = np.linalg.eigh(second / 12.0)
    return middle, moments, axes
