"""What tetrahedra leave out of the solid that they were made for: the corners, holes and steps near their boundary."""

from __future__ import annotations

import numpy as np

from calmotion.geometry.distances import triangle_parts
from calmotion.geometry.nearby_triangles import NearbyTriangles
from calmotion.geometry.tetrahedra import Indices, boundary_triangles
from calmotion.shot.character import Array, IntArray
from calmotion.shot.meshes import MissingVolume

_SAMPLES, _PLACES = triangle_parts(6), triangle_parts(2)  # of a triangle: of the distance, and what is kept
_EXACT = 1e-6  # distance that is none, of the diagonal


def missing_volume(
    points: Array, tets: IntArray, surface_points: Array, triangles: Indices, limit: float
) -> MissingVolume | None:
    """The volume between the boundary of tetrahedra and a surface; None where they agree.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], positive volumes.
        surface_points: Of the closed surface that was meshed [m], shape [k, 3].
        triangles: Of the surface, outward, shape [l, 3].
        limit: Largest distance of the two [m]: where they are farther apart nothing is known, and nothing counted.
    """
    corners = points[boundary_triangles(tets)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(doubled, np.finfo(float).tiny)[:, None]
    at = np.einsum("pk,tkx->tpx", _SAMPLES, corners)
    gap = NearbyTriangles(surface_points, triangles, limit).closest(at.reshape(-1, 3)).reshape(at.shape) - at
    height = np.nan_to_num(np.einsum("tpx,tx->tp", gap, normal))
    volumes = 0.5 * doubled[:, None] / len(_SAMPLES) * (height @ _NEAREST)
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    counted = np.abs(volumes) > _EXACT * diagonal * 0.5 * doubled[:, None] / len(_PLACES)
    if not counted.any():
        return None
    return MissingVolume(np.einsum("pk,tkx->tpx", _PLACES, corners)[counted], volumes[counted])


def _nearest() -> Array:
    """One for each sample at the place that is nearest to it, shape [samples, places]."""
    distance = np.linalg.norm(_SAMPLES[:, None] - _PLACES, axis=2)
    return np.asarray(np.eye(len(_PLACES))[distance.argmin(axis=1)])


_NEAREST = _nearest()
