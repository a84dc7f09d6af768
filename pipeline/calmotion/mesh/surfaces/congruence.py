"""The motion or reflection that takes one surface to another: a left arm is mostly the mirrored right one."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from calmotion.arrays import Array, Indices, box_diagonal
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import surface_area, surface_volume

# Surfaces that are alike, whatever their triangles: largest relative difference of areas, volumes and moments; and
# distances, of the size, that no place and a tenth of the places exceed. Those of the arms of a Unitree G1 differ by
# 1e-5, 5e-4 and 9e-5, and by 1.7e-3 and 1.6e-4 of the size.
_ALIKE, _FAR, _MOSTLY, _PART = 1e-3, 2e-3, 2e-4, 0.9
_ROUND = 1e-3  # relative difference of principal moments below which their axes are not known
_PLACES = 20_000  # at which surfaces are compared


@dataclass(frozen=True, eq=False)
class Isometry:
    """x -> turn x + move.

    Attributes:
        turn: Orthogonal, shape [3, 3]; its determinant is -1 for a reflection.
        move: [m], shape [3].
        distance: Of the surfaces after it, at most [m].
    """

    turn: Array
    move: Array
    distance: float = 0.0

    @property
    def mirrors(self) -> bool:
        """Whether it is a reflection."""
        return bool(np.linalg.det(self.turn) < 0.0)

    def __call__(self, points: Array) -> Array:
        """Points [m], shape [..., 3], after it."""
        return np.asarray(points @ self.turn.T + self.move)


def isometries(points: Array, triangles: Indices, other: Array, others: Indices) -> Iterator[Isometry]:
    """The isometries that take a surface to one that is alike, first the identity, then motions, then reflections.

    A surface with an axis of symmetry, or whose principal moments are nearly equal, is only found where it is not
    turned.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].
        other, others: The other surface; it may have other points and triangles.
    """
    size = box_diagonal(points)
    for isometry in _candidates(points, triangles, other, others):
        moved, most = isometry(points), _FAR * size
        apart = [
            _distances(_places(moved, triangles), other, others, most),
            _distances(_places(other, others), moved, triangles, most),
        ]
        if all(far.max() <= most and np.quantile(far, _PART) <= _MOSTLY * size for far in apart):
            yield replace(isometry, distance=float(max(far.max() for far in apart)))


def _places(points: Array, triangles: Indices) -> Array:
    """Points, and the middles of triangles and of edges; some of many."""
    corners = points[triangles]
    middles = [corners.mean(axis=1), *(0.5 * (corners[:, i] + corners[:, j]) for i, j in ((0, 1), (1, 2), (2, 0)))]
    places = np.vstack([points, *middles])
    return places[:: 1 + len(places) // _PLACES]


def _distances(places: Array, points: Array, triangles: Indices, reach: float) -> Array:
    """Distances of places to a surface [m]; infinite beyond the reach."""
    far = np.linalg.norm(NearbyTriangles(points, triangles, reach).closest(places) - places, axis=1)
    return np.where(np.isnan(far), np.inf, far)


def _candidates(points: Array, triangles: Indices, other: Array, others: Indices) -> list[Isometry]:
    """What may be isometries by areas, volumes and principal moments."""
    size = box_diagonal(points)
    if not np.isclose(surface_area(points, triangles), surface_area(other, others), rtol=_ALIKE, atol=0.0):
        return []
    (center, moments, axes), (end, last, ends) = _principal(points, triangles), _principal(other, others)
    # about the center, that of an open surface is the same too; the mirror image of one may be inside out
    enclosed, same = (abs(surface_volume(*each)) for each in ((points - center, triangles), (other - end, others)))
    if not np.isclose(enclosed, same, rtol=_ALIKE, atol=1e-5 * size**3):
        return []
    if np.abs(moments - last).max() > 10.0 * _ALIKE * moments.max():
        return []
    candidates = [Isometry(np.eye(3), end - center)]
    if np.diff(moments).min() > _ROUND * moments.max():
        turns = [ends @ np.diag(signs) @ axes.T for signs in product((1.0, -1.0), repeat=3)]
        turns.sort(key=lambda turn: -np.linalg.det(turn))
        candidates += [
            Isometry(turn, end - turn @ center)
            for turn in turns
            if not np.allclose(turn, np.eye(3), atol=1e-4)  # it is the first
        ]
    return candidates


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
