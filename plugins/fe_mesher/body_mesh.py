"""From what a body carries to its tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from calmotion.errors import ShotError
from calmotion.fem.element_size import automatic_element_size, envelope
from calmotion.fem.tetrahedra import connected_parts, measure_quality, oriented_tets, without_unused_points
from calmotion.shot import Body, FEMesh, SurfaceMesh, TetGeometry

from .mesh_file import read_mesh_file
from .repair import Solid, closed_solid, simplified
from .tetwild import tetrahedralize

MAX_VOLUME_ERROR = 0.01
_ATTEMPTS = 3
_DETAIL = 0.1  # of the envelope: detail that the mesh does not follow anyway


@dataclass(frozen=True)
class MeshOptions:
    """What the user set: element size [m] (negative: as the shot says), time limit [s], use of the cache."""

    element_size: float = -1.0
    time_limit: float = 300.0
    cache: bool = True


def mesh_body(index: int, body: Body, options: MeshOptions) -> FEMesh:
    """The tetrahedra of a flexible body: authored ones, else those of its mesh file, else of its surfaces.

    Args:
        index: Of the body in its character.
        body: With `flexible` settings.
        options: What the user set.

    Raises:
        ShotError: There is no geometry, it encloses no volume, or it cannot be meshed.
    """
    settings = body.flexible
    assert settings is not None
    geometry: TetGeometry | tuple[SurfaceMesh, ...]
    if body.tets is not None:
        geometry = body.tets
    elif settings.mesh_file:
        geometry = read_mesh_file(settings.mesh_file, settings.mesh_scale, body.path)
    else:
        geometry = body.surfaces
    if isinstance(geometry, TetGeometry):
        return _authored(index, geometry)
    if not any(len(surface.triangles) for surface in geometry):
        raise ShotError(
            "is flexible but has no geometry", path=body.path, found="neither TetMesh nor Mesh nor mesh file",
            remedy="Add a closed Mesh below it, or name a mesh file in calm:flexible:meshFile",
        )  # fmt: skip
    size = options.element_size if options.element_size > 0.0 else settings.element_size
    return _from_surfaces(index, body, geometry, replace(options, element_size=size))


def _authored(index: int, geometry: TetGeometry) -> FEMesh:
    tets, turned = oriented_tets(geometry.points, geometry.tets, geometry.path)
    points, tets = without_unused_points(np.asarray(geometry.points, dtype=float), tets)
    repairs = []
    if turned:
        repairs.append(f"turned {turned} inverted tetrahedra")
    if len(points) < len(geometry.points):
        repairs.append(f"dropped {len(geometry.points) - len(points)} points that no tetrahedron uses")
    _refuse_loose_parts(tets, geometry.path)
    return FEMesh(index, points, tets, measure_quality(points, tets, repairs=tuple(repairs)))


def _from_surfaces(index: int, body: Body, surfaces: tuple[SurfaceMesh, ...], options: MeshOptions) -> FEMesh:
    solid = _solid(body, surfaces)
    size = options.element_size if options.element_size > 0.0 else automatic_element_size(solid.volume)
    diagonal = float(np.linalg.norm(np.ptp(solid.points, axis=0)))
    error = np.inf
    for attempt in range(_ATTEMPTS):
        distance = envelope(size, diagonal, len(solid.triangles), attempt)
        surface = simplified(solid, _DETAIL * distance)
        points, tets = tetrahedralize(*surface, size, distance / diagonal, body.path, options.time_limit, options.cache)
        tets, _ = oriented_tets(points, tets, body.path)
        points, tets = without_unused_points(points, tets)
        quality = measure_quality(points, tets, surface_volume=solid.volume, repairs=solid.repairs)
        error = quality.volume_error
        if error <= MAX_VOLUME_ERROR:
            _refuse_loose_parts(tets, body.path)
            return FEMesh(index, points, tets, quality)
        size *= 0.8
    raise ShotError(
        "the tetrahedra do not fill the surface", path=body.path,
        found=f"volume off by {100.0 * error:.2g}%, allowed {100.0 * MAX_VOLUME_ERROR:.2g}%",
        remedy="Author a smaller calm:flexible:elementSize, repair the Mesh, or give a TetMesh or a mesh file",
    )  # fmt: skip


def _solid(body: Body, surfaces: tuple[SurfaceMesh, ...]) -> Solid:
    """The solid of what is seen; of hidden (collision) geometry where what is seen is not closed."""
    seen = tuple(s for s in surfaces if s.visible) or surfaces
    hidden = tuple(s for s in surfaces if not s.visible)
    try:
        return closed_solid(seen, body.path)
    except ShotError as error:
        if not hidden or seen is surfaces:
            raise
        try:
            solid = closed_solid(hidden, body.path)
        except ShotError:
            raise error from None
        note = f"meshed the collision geometry, since {error.path} {error.problem}"
    return replace(solid, repairs=(note, *solid.repairs))


def _refuse_loose_parts(tets: np.ndarray, path: str) -> None:
    count = connected_parts(tets)
    if count > 1:
        raise ShotError(
            "its tetrahedra do not hang together", path=path, found=f"{count} separate parts",
            remedy="Make the parts overlap or touch, or split them into several bodies",
        )  # fmt: skip
