"""What tetrahedra leave out of the solid that they were made for: the corners, holes and steps near their boundary."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.grids.boundary_fit import PARTS, heights
from calmotion.mesh.surfaces.distances import triangle_parts
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import boundary_triangles
from calmotion.model.meshes import MissingVolume

_PLACES = triangle_parts(2)  # of a triangle, for which the volume is kept
_EXACT = 1e-6  # distance that is none, of the diagonal


def missing_volume(points: Array, tets: IntArray, surface: NearbyTriangles) -> MissingVolume | None:
    """The volume between the boundary of tetrahedra and a surface; None where they agree.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], positive volumes.
        surface: The closed, outward surface that was meshed. Where the two are farther apart than its reach nothing is
            known, and nothing counted.
    """
    corners = points[boundary_triangles(tets)]
    height, _, area = heights(corners, surface)
    volumes = area[:, None] / len(PARTS) * (np.nan_to_num(height) @ _NEAREST)
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    counted = np.abs(volumes) > _EXACT * diagonal * area[:, None] / len(_PLACES)
    if not counted.any():
        return None
    return MissingVolume(np.einsum("pk,tkx->tpx", _PLACES, corners)[counted], volumes[counted])


def _nearest() -> Array:
    """One for each of `PARTS` at the place that is nearest to it, shape [parts, places]."""
    distance = np.linalg.norm(PARTS[:, None] - _PLACES, axis=2)
    return np.asarray(np.eye(len(_PLACES))[distance.argmin(axis=1)])


_NEAREST = _nearest()
