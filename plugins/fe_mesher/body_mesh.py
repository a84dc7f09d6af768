"""Tetrahedra of a flexible body."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from calmotion.accuracy.element_size import (
    MAX_NODES,
    Shape,
    element_size,
    envelope,
    expected_nodes,
    shape_of,
    smallest_size,
)
from calmotion.errors import ShotError
from calmotion.geometry.tetrahedra import (
    connected_parts,
    measure_quality,
    oriented_tets,
    welded_tets,
    without_unused_points,
)
from calmotion.shot import Body, FEMesh, Frame, SurfaceMesh, TetGeometry

from .accuracy import ENOUGH, remark
from .mesh_file import read_mesh_file
from .repair import Solid, closed_solid, simplified
from .tetwild import MORE_TIME, ProcessorTime, tetrahedralize

# Wanted and largest allowed error. An error of half a percent of volume in thin walls is larger than that in a
# frequency. Meshing tens of thousands of triangles takes minutes, so there the first allowed mesh is used.
_GOOD_VOLUME, MAX_VOLUME_ERROR = 0.005, 0.01
_ATTEMPTS = 3
_WELD = 1e-6  # distance of coincident points, of the diagonal
# detail that is removed, of the envelope, which the mesh does not resolve; number of triangles of a dense surface
_DETAIL, _DENSE_DETAIL, _DENSE = 0.1, 0.5, 15_000


@dataclass(frozen=True)
class MeshOptions:
    """Settings of the user.

    Attributes:
        element_size: [m]; negative: that of the shot.
        time_limit: Of the processor time of the meshes of one body [s].
        cache: Whether the cache is used.
    """

    element_size: float = -1.0
    time_limit: float = 300.0
    cache: bool = True


@dataclass(frozen=True, eq=False)
class Volume:
    """A solid to be meshed, its dimensions, and the requested size of its elements [m] (not positive: automatic)."""

    solid: Solid
    shape: Shape
    size: float


def mesh_body(index: int, body: Body, options: MeshOptions, carrier: Frame | None = None) -> FEMesh:
    """The tetrahedra of a flexible body; arguments and errors as of `geometry_of` and `mesh_of`."""
    return mesh_of(index, body, geometry_of(index, body, options), options, carrier)


def mesh_of(
    index: int, body: Body, geometry: FEMesh | Volume, options: MeshOptions, carrier: Frame | None = None
) -> FEMesh:
    """The tetrahedra of a geometry.

    Args:
        index: Of the body in its character.
        body: With `flexible` settings.
        geometry: See `geometry_of`.
        options: Settings of the user.
        carrier: Frame of the joint to its parent, body frame.

    Raises:
        ShotError: It cannot be meshed.
    """
    if isinstance(geometry, FEMesh):
        return _judged(geometry, body, carrier)
    if geometry.size > 0.0:
        time = ProcessorTime(options.time_limit)
        mesh = filled(index, body, geometry.solid, geometry.shape, geometry.size, time, options.cache)
        return _judged(mesh, body, carrier)
    return _accurate(index, body, geometry, options, carrier)


def geometry_of(index: int, body: Body, options: MeshOptions) -> FEMesh | Volume:
    """The geometry of a flexible body: authored tetrahedra, else that of its mesh file, else of its surfaces.

    It is read and closed in seconds, while meshes take minutes: what is wrong with it is known before any mesh is made.

    Raises:
        ShotError: There is no geometry, it encloses no volume, or the requested elements are too small.
    """
    settings = body.flexible
    assert settings is not None
    if body.tets is not None:
        return _authored(index, body.tets, ())
    surfaces = body.surfaces
    repairs: tuple[str, ...] = ()
    if settings.mesh_file:
        geometry, repairs = read_mesh_file(settings.mesh_file, settings.mesh_scale, body.path)
        if isinstance(geometry, TetGeometry):
            return _authored(index, geometry, repairs)
        surfaces = geometry
    if not any(len(surface.triangles) for surface in surfaces):
        raise ShotError(
            "this flexible body has no geometry", path=body.path, found="no TetMesh, Mesh or mesh file",
            remedy="Add a closed Mesh below it, or name a mesh file in calm:flexible:meshFile",
        )  # fmt: skip
    solid = solid_of(body, surfaces)
    solid = replace(solid, repairs=(*repairs, *solid.repairs))
    size = options.element_size if options.element_size > 0.0 else settings.element_size
    shape = shape_of(solid.points, solid.triangles)
    if size > 0.0:
        _refuse_too_many(shape, size, ProcessorTime(options.time_limit), body.path)
    return Volume(solid, shape, size)


def _authored(index: int, geometry: TetGeometry, repairs: tuple[str, ...]) -> FEMesh:
    tets, inverted = oriented_tets(geometry.points, geometry.tets, geometry.path)
    points, tets = without_unused_points(np.asarray(geometry.points, dtype=float), tets)
    if inverted:
        repairs += (f"reoriented {inverted} inverted tetrahedra",)
    if len(points) < len(geometry.points):
        repairs += (f"removed {len(geometry.points) - len(points)} points that no tetrahedron uses",)
    if connected_parts(tets) > 1:
        points, tets, merged = welded_tets(points, tets, _WELD)
        if merged:
            repairs += (f"merged {merged} coincident points of separate parts",)
    _refuse_loose_parts(tets, geometry.path)
    return FEMesh(index, points, tets, measure_quality(points, tets, repairs=repairs))


def _judged(mesh: FEMesh, body: Body, carrier: Frame | None) -> FEMesh:
    """A mesh whose elements are given, with its estimated error; a mesh that is too large for the estimate without."""
    from calmotion.reduction.mesh_refinement import refined_for_frequencies

    if len(mesh.points) > MAX_NODES:
        return replace(mesh, given=True)
    return replace(refined_for_frequencies(mesh, body, carrier, np.inf, 0), given=True)


def _accurate(index: int, body: Body, volume: Volume, options: MeshOptions, carrier: Frame | None) -> FEMesh:
    """Tetrahedra fine enough for the first frequencies; where the shot needs more, they are refined for its loads."""
    from calmotion.reduction.mesh_refinement import refined_for_frequencies

    solid, shape = volume.solid, volume.shape
    time = ProcessorTime(options.time_limit)
    mesh = filled(index, body, solid, shape, element_size(shape), time, options.cache)
    mesh = refined_for_frequencies(mesh, body, carrier, ENOUGH, MAX_NODES)
    repairs = (*mesh.quality.repairs, *remark(mesh.quality))
    return replace(mesh, quality=replace(mesh.quality, repairs=repairs))


def filled(
    index: int, body: Body, solid: Solid, shape: Shape, size: float, time: ProcessorTime, use_cache: bool = True
) -> FEMesh:
    """Tetrahedra of uniform size that fill a solid.

    Args:
        index: Of the body in its character.
        body: For errors.
        solid: Closed.
        shape: Of the solid.
        size: Edge length [m].
        time: Processor time of the body.
        use_cache: Whether the cache folder is used.

    Raises:
        ShotError: The solid cannot be meshed, or the tetrahedra do not fill it.
    """
    _refuse_too_many(shape, size, time, body.path)
    diagonal = float(np.linalg.norm(np.ptp(solid.points, axis=0)))
    dense = len(solid.triangles) > _DENSE
    volumes: list[float] = []
    best: FEMesh | None = None
    for attempt in range(_ATTEMPTS):
        distance = envelope(size, diagonal, shape.thickness, len(solid.triangles), attempt)
        surface = simplified(solid, (_DENSE_DETAIL if dense else _DETAIL) * distance)
        points, tets = tetrahedralize(*surface, size, distance / diagonal, body.path, time, use_cache)
        tets, _ = oriented_tets(points, tets, body.path)
        points, tets = without_unused_points(points, tets)
        quality = measure_quality(points, tets, surface_volume=solid.volume, repairs=solid.repairs)
        if quality.volume_error <= MAX_VOLUME_ERROR:
            if best is None or quality.volume_error < best.quality.volume_error:
                best = FEMesh(index, points, tets, quality)
            if quality.volume_error <= _GOOD_VOLUME or dense or attempt == 1:
                break
        volumes.append(quality.volume)
        size *= 0.8 if best is None else 1.0
    if best is not None:
        _refuse_loose_parts(best.tets, body.path)
        return best
    error = abs(volumes[-1] / solid.volume - 1.0)
    # meshes of smaller envelopes with equal volumes that differ from that of the surface: the surface is wrong
    agree = abs(volumes[-1] - volumes[-2]) < 0.2 * error * solid.volume
    raise ShotError(
        "the tetrahedra do not fill the surface" + (", which seems to intersect itself" if agree else ""),
        path=body.path, found=f"volume error {100.0 * error:.2g}%, allowed {100.0 * MAX_VOLUME_ERROR:.2g}%",
        remedy="Author a smaller calm:flexible:elementSize, repair the Mesh, or give a TetMesh or a mesh file",
    )  # fmt: skip


def _refuse_too_many(shape: Shape, size: float, time: ProcessorTime, path: str) -> None:
    """Refuse a mesh that would exceed the limit of processor time on any machine, before the time is spent."""
    nodes = expected_nodes(shape, size)
    if nodes > time.nodes:
        least, limit = smallest_size(shape, int(time.nodes)), time.limit * nodes / time.nodes
        raise ShotError(
            f"its mesh would have about {nodes:.1e} nodes, too many for {time.limit:g} s of processor time",
            path=path, attribute="calm:flexible:elementSize", found=f"{size:.3g} m",
            remedy=f"Author at least {least:.2g} m" + MORE_TIME.format(limit),
        )  # fmt: skip


def solid_of(body: Body, surfaces: tuple[SurfaceMesh, ...]) -> Solid:
    """The solid of the visible surfaces, or of hidden (collision) surfaces where the visible ones are not closed."""
    visible = tuple(s for s in surfaces if s.visible) or surfaces
    hidden = tuple(s for s in surfaces if not s.visible)
    try:
        return closed_solid(visible, body.path)
    except ShotError as error:
        if not hidden or visible is surfaces:
            raise
        try:
            solid = closed_solid(hidden, body.path)
        except ShotError:
            raise error from None
        note = f"meshed the collision geometry instead of the visible surfaces ({error.path}: {error.problem})"
    return replace(solid, repairs=(note, *solid.repairs))


def _refuse_loose_parts(tets: np.ndarray, path: str) -> None:
    count = connected_parts(tets)
    if count > 1:
        raise ShotError(
            "its tetrahedra are not connected", path=path, found=f"{count} separate parts",
            remedy="Make the parts overlap or touch, or split them into several bodies",
        )  # fmt: skip
