"""Tetrahedra that follow the surface in the mean, cut along the rims of the interface patches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from calmotion.arrays import Array, Indices, IntArray
from calmotion.mesh.grids.boundary_fit import fitted
from calmotion.mesh.patches.cut_patches import with_rims
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import measure_quality
from calmotion.model.character import Body
from calmotion.model.meshes import CutPatch, FEMesh

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
