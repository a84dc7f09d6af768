"""The boundary of tetrahedra as the best fit of a surface.

Corners that lie on a curved surface make the triangles between them chords: every round part of the body is thinner
than it should be, and softer by about twice the volume that is missing. Corners that lie somewhat outside, so that the
triangles leave the surface to both sides alike, have an error of fourth order in the size of the triangles instead of
second. Flat faces and edges stay where they are.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.surfaces.distances import triangle_parts
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles, unit_normals
from calmotion.mesh.tetrahedra import boundary_triangles, tet_volumes

_PASSES = 2
_HOLD = 1e-3  # weight of the movement itself: keeps corners from sliding along the surface
_THINNEST = 0.5  # least part of its volume that a tetrahedron keeps


PARTS = triangle_parts(6)  # of each triangle, at whose centers the distance is measured


def fitted(points: Array, tets: IntArray, surface: NearbyTriangles) -> Array:
    """Points of the tetrahedra with the boundary moved to the best fit of a surface, by least squares of the distance.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], positive volumes.
        surface: The closed surface that was meshed. Where the two are farther apart than its reach, as in a groove that
            the mesh omits, the boundary is not fitted, and no corner moves farther.

    Returns:
        The points [m], shape [n, 3].
    """
    boundary, limit = boundary_triangles(tets), surface.reach
    volumes, moved = tet_volumes(points, tets), points
    for _ in range(_PASSES):
        moved = moved + _step(moved, boundary, surface)
    step = moved - points
    length = np.linalg.norm(step, axis=1)
    step *= np.minimum(1.0, limit / np.maximum(length, np.finfo(float).tiny))[:, None]
    while True:
        flattened = tet_volumes(points + step, tets) < _THINNEST * volumes
        if not flattened.any():
            return np.asarray(points + step)
        step[tets[flattened]] = 0.0


def heights(corners: Array, surface: NearbyTriangles) -> tuple[Array, Array, Array]:
    """How far a surface is above triangles, along their normals.

    Args:
        corners: Of the triangles [m], shape [t, 3, 3], outward.

    Returns:
        Heights above the centers of `PARTS` [m], shape [t, p], NaN where the surface is farther than its reach; unit
        normals of the triangles, shape [t, 3]; and their areas [m^2], shape [t].
    """
    normal, area = unit_normals(corners)
    at = np.einsum("pk,tkx->tpx", PARTS, corners)
    gap = surface.closest(at.reshape(-1, 3)).reshape(at.shape) - at
    return np.einsum("tpx,tx->tp", gap, normal), normal, area


def _step(points: Array, boundary: IntArray, surface: NearbyTriangles) -> Array:
    """Movement of all points that fits the boundary, to first order [m], shape [n, 3]."""
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import spsolve

    height, normal, area = heights(points[boundary], surface)
    known = np.isfinite(height)
    distance = np.where(known, height, 0.0)
    weight = np.where(known, area[:, None] / len(PARTS), 0.0)
    # the normal movement is N_k v_k . n on each triangle; normal equations for v, three entries a corner
    shapes = np.einsum("tp,pk,pl->tkl", weight, PARTS, PARTS)
    block = np.einsum("tkl,tx,ty->tkxly", shapes, normal, normal)
    right = np.einsum("tp,tp,pk,tx->tkx", weight, distance, PARTS, normal)
    used, number = np.unique(boundary, return_inverse=True)
    places = (3 * number.reshape(boundary.shape)[:, :, None] + np.arange(3)).reshape(len(boundary), 9)
    size = 3 * len(used)
    rows, columns = np.repeat(places, 9, axis=1).ravel(), np.tile(places, 9).ravel()
    A = coo_matrix((block.reshape(len(boundary), -1).ravel(), (rows, columns)), shape=(size, size)).tocsc()
    lumped = np.bincount(places.ravel(), np.repeat(area / 3.0, 9), size)
    b = np.bincount(places.ravel(), right.reshape(len(boundary), 9).ravel(), size)
    step = np.zeros_like(points)
    step[used] = spsolve(A + diags(_HOLD * lumped), b).reshape(-1, 3)
    return step
