"""Tetrahedra that follow the surface in the mean, cut along the rims of the interface patches."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import spsolve

from calmotion.arrays import Array, Indices, IntArray
from calmotion.mesh.patches.cut_patches import with_rims
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.surfaces.distances import triangle_parts
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles, unit_normals
from calmotion.mesh.tetrahedra import boundary_triangles, measure_quality, tet_volumes
from calmotion.model.character import Body
from calmotion.model.meshes import CutPatch, FEMesh

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


_FILLED = 5e-3  # error of the volume of elements that fill what the surface encloses, and no other body


@dataclass(frozen=True, eq=False)
class Surface:
    """What a mesh was made for.

    Attributes:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3], closed, outward.
        volume: That it winds around [m^3].
        limit: Largest distance that a corner of the mesh may have to be moved to it [m].
    """

    points: Array
    triangles: Indices
    volume: float
    limit: float

    @property
    def nodes(self) -> Array:
        """Its points, as of a mesh."""
        return self.points

    @property
    def surface(self) -> Indices:
        """Its triangles, as of a mesh."""
        return self.triangles


def shaped(mesh: FEMesh, body: Body, surface: Surface, attachments: Sequence[AttachmentFrame]) -> FEMesh:
    """The mesh, cut along the rims of its interface patches, with its boundary fitted to the surface.

    Args:
        mesh: Whose elements were made for the surface.
        body: With `flexible` settings.
        attachments: Frames of the joints and targets of the body; without any, nothing is cut.
    """
    points, tets, rims = with_rims(mesh.points, mesh.tets, body, attachments, surface)
    near = NearbyTriangles(surface.points, surface.triangles, surface.limit)
    moved = fitted(points, tets, near)
    cut, fit = (_with(mesh, x, tets, rims, surface.volume) for x in (points, moved))
    # a surface that runs through itself is not what the elements fill
    return cut if fit.quality.volume_error > max(cut.quality.volume_error, _FILLED) else fit


def _with(mesh: FEMesh, points: Array, tets: IntArray, rims: Sequence[tuple[Array, IntArray]], volume: float) -> FEMesh:
    """The mesh with other elements, and patches that consist of some of their triangles."""
    found = measure_quality(points, tets, surface_volume=volume)
    quality = replace(
        mesh.quality, min_dihedral_deg=found.min_dihedral_deg, volume=found.volume, volume_error=found.volume_error
    )
    patches = tuple(CutPatch(origin, points[triangles]) for origin, triangles in rims)
    return replace(mesh, points=points, tets=tets, quality=quality, patches=patches)
