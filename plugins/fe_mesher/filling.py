"""Tetrahedra that fill a solid, within a limit of processor time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from calmotion.accuracy.element_size import Shape, envelope, expected_nodes, smallest_size
from calmotion.errors import ShotError
from calmotion.geometry.closed_surfaces import enclosed_volume
from calmotion.geometry.grids.boundary_fit import fitted
from calmotion.geometry.grids.grid_tets import GRID, grid_tets
from calmotion.geometry.tetrahedra import (
    connected_parts,
    largest_part,
    measure_quality,
    oriented_tets,
    tet_volumes,
    without_unused_points,
)
from calmotion.shot import Body, FEMesh

from .repair import Solid, simplified
from .tetwild import MORE_TIME, REMEDY, OutOfTime, ProcessorTime, tetrahedralize

# Wanted and largest allowed error. An error of half a percent of volume in thin walls is larger than that in a
# frequency. Where a better mesh would take too long, a larger error is accepted and reported.
_GOOD_VOLUME, MAX_VOLUME_ERROR, _ACCEPTED = 0.005, 0.01, 0.05
# Detail that is removed, of the envelope, which the mesh does not resolve; more of it on dense surfaces, until they
# have few enough triangles: fTetWild takes 1.5 ms for each.
_DETAIL, _DENSE_DETAILS, DENSE, _MANY = 0.1, (0.5, 1.0), 2_500, 8_000
_ATTEMPTS = 3
# Share of the time for the first mesh: what is left is for a coarser one, or that of a grid, which is made in seconds
_FIRST, _FIRST_DENSE = 0.6, 0.2
_COARSER = 1.6  # factor of size and envelope of a mesh that took too long
_SOON = 1 / 3  # share of the time that a surface with many details may take
_TRIANGLE = 2.5e-3  # least processor time for a triangle of a surface with many details [s]
_COARSEST = 0.3  # largest error of the volume of a mesh of a grid, which is reported
_LOOSE = 0.05  # of the volume: parts that a thin connection, which the mesh did not follow, held

# Largest number of nodes of ten-node tetrahedra: twice as many where walls are
# thin, for some ten seconds (with 16,000, links took 21 to 34 s and were no more exact); walls that are thinner than
# the spacing have gaps. A longer limit of time allows more.
_GRID_NODES, _GRID_TIME = 10_000, 60.0
_GRID_WALL = 0.8  # of the thinner walls: spacing with which they have none
# Factor of the spacing while the volume error is larger than that; largest way of a corner to the surface
_FINER, _NEAR_VOLUME, _MOVED = 0.8, 0.02, 0.5


@dataclass(frozen=True)
class _Attempt:
    """Size of the elements and distance to the surface of a mesh [m]."""

    size: float
    distance: float


def filled(
    index: int, body: Body, solid: Solid, shape: Shape, size: float, time: ProcessorTime, use_cache: bool = True
) -> FEMesh:
    """Tetrahedra of uniform size that fill a solid.

    A mesh that takes, or would take, most of the time is replaced by one of a regular grid. A mesh with an error of its
    volume is followed by one that is closer to the surface as long as there is time; the best one counts, with its
    error.

    Args:
        index: Of the body in its character.
        body: For errors.
        solid: Closed.
        shape: Of the solid.
        size: Edge length [m].
        time: Processor time of the body.
        use_cache: Whether the cache folder is used.

    Raises:
        OutOfTime: It cannot be meshed in time, not even on a grid.
        ShotError: The solid cannot be meshed, or the tetrahedra do not fill it.
    """
    refuse_too_many(shape, size, time, body.path)
    volumes: list[float] = []
    best: FEMesh | None = None
    notes: tuple[str, ...] = ()
    begun, dense = time.used, len(solid.triangles) > DENSE
    diagonal = float(np.linalg.norm(np.ptp(solid.points, axis=0)))
    for number in range(_ATTEMPTS):
        attempt = _Attempt(size, envelope(size, diagonal, shape.thickness, len(solid.triangles), number))
        try:
            share = _FIRST_DENSE if dense else _FIRST
            points, tets = _meshed(solid, attempt, body.path, time, share, use_cache)
        except OutOfTime as reason:
            if best is not None:
                break
            gridded = _on_grid(index, body, solid, shape, size, reason, time)
            if gridded is not None:
                return gridded
            if dense:  # as hopeless
                raise
            # as far from the surface as one of many triangles is followed
            wide = envelope(_COARSER * size, diagonal, shape.thickness, DENSE, 0)
            coarser = _Attempt(_COARSER * attempt.size, max(_COARSER * attempt.distance, wide))
            points, tets = _meshed(solid, coarser, body.path, time, 1.0, use_cache)
            notes = (f"meshed with elements {_COARSER:g} times as large, since smaller ones took too long",)
        quality = measure_quality(points, tets, surface_volume=solid.volume, repairs=(*solid.repairs, *notes))
        volumes.append(quality.volume)
        if best is None or quality.volume_error < best.quality.volume_error:
            best = FEMesh(index, points, tets, quality)
        # a mesh that is closer to the surface takes about twice as long
        late = time.used - begun > 0.25 * time.limit and best.quality.volume_error <= _ACCEPTED
        enough = MAX_VOLUME_ERROR if number or dense else _GOOD_VOLUME
        if best.quality.volume_error <= enough or notes or late:
            break
        size *= 0.8 if best.quality.volume_error > MAX_VOLUME_ERROR else 1.0
    assert best is not None
    try:
        accepted = _accepted(best, solid, volumes, body.path)
    except ShotError as error:
        gridded = _on_grid(index, body, solid, shape, size, error, time)
        if gridded is None:
            raise
        return gridded
    return _whole(accepted, body.path)


def _meshed(
    solid: Solid, attempt: _Attempt, path: str, time: ProcessorTime, share: float, use_cache: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Tetrahedra that take no more than a share of what is left of the time."""
    diagonal = float(np.linalg.norm(np.ptp(solid.points, axis=0)))
    points, triangles = _simplified(solid, attempt.distance)
    part = time.part(share)
    if len(triangles) > _MANY and _TRIANGLE * len(triangles) > _SOON * time.limit:
        raise OutOfTime(
            "tetrahedralising would exceed the limit of processor time", path=path,
            found=f"{len(triangles)} triangles, {time.limit:g} s", remedy=REMEDY + MORE_TIME.format(4.0 * time.limit),
        )  # fmt: skip
    try:
        made, tets = tetrahedralize(
            points, triangles, attempt.size, attempt.distance / diagonal, path, part, use_cache
        )  # fmt: skip
    except OutOfTime:
        time.used = part.limit
        raise
    time.used = part.used
    tets, _ = oriented_tets(made, tets, path)
    return without_unused_points(made, tets)


def _on_grid(
    index: int, body: Body, solid: Solid, shape: Shape, size: float, reason: ShotError, time: ProcessorTime
) -> FEMesh | None:  # fmt: skip
    """The tetrahedra of a grid, for a reason; None where it does not resolve thin walls."""
    nodes = int(_GRID_NODES * max(time.limit / _GRID_TIME, 1.0))
    mesh = on_grid(index, body, solid, shape, size, nodes)
    dense = len(solid.triangles) > DENSE or time.used >= time.limit
    if mesh is None or mesh.quality.volume_error > (_COARSEST if dense else _ACCEPTED):
        return None
    followed = expected_nodes(shape, size) <= nodes
    note = grid_note(mesh, f"{reason.problem} ({reason.found})", followed)
    return replace(mesh, quality=replace(mesh.quality, repairs=(*mesh.quality.repairs, note)))


def _simplified(solid: Solid, distance: float) -> tuple[np.ndarray, np.ndarray]:
    """The surface without detail that a mesh at a distance does not resolve."""
    surface = solid.points, solid.triangles
    for detail in (_DETAIL,) if len(solid.triangles) <= DENSE else _DENSE_DETAILS:
        surface = simplified(solid, detail * distance)
        if len(surface[1]) <= _MANY:
            break
    return surface


def _accepted(mesh: FEMesh, solid: Solid, volumes: list[float], path: str) -> FEMesh:
    """The mesh, where its volume is that of the surface, or nearly so and the error is reported.

    A surface that intersects itself has another volume than what it winds around, which the mesh fills.
    """
    error = mesh.quality.volume_error
    if error <= MAX_VOLUME_ERROR:
        return mesh
    notes = mesh.quality.repairs
    if len(volumes) > 1 and abs(volumes[-1] - volumes[-2]) < 0.2 * error * solid.volume:
        wound = enclosed_volume(solid.points, solid.triangles)
        error = abs(mesh.quality.volume / wound - 1.0)
        notes = (*notes, "its surface intersects itself: the volume is that of all that it winds around")
    if error > _ACCEPTED:
        raise ShotError(
            "the tetrahedra do not fill the surface",
            path=path, found=f"volume error {100.0 * error:.2g}%, allowed {100.0 * _ACCEPTED:.2g}%",
            remedy="Author a smaller calm:flexible:elementSize, repair the Mesh, or give a TetMesh or a mesh file",
        )  # fmt: skip
    if error > MAX_VOLUME_ERROR:
        notes = (*notes, f"its volume differs from that of the surface by {100.0 * error:.2g}%")
    return replace(mesh, quality=replace(mesh.quality, volume_error=error, repairs=notes))


def _whole(mesh: FEMesh, path: str) -> FEMesh:
    """The mesh without small parts that a connection thinner than the distance to the surface held."""
    if connected_parts(mesh.tets) == 1:
        return mesh
    kept = largest_part(mesh.points, mesh.tets)
    volume = float(tet_volumes(mesh.points, kept).sum())
    lost = 1.0 - volume / mesh.quality.volume
    if lost > _LOOSE:
        refuse_loose_parts(mesh.tets, path)
    points, tets = without_unused_points(mesh.points, kept)
    notes = (*mesh.quality.repairs, f"removed loose parts of the mesh, {100.0 * lost:.2g}% of the volume")
    return replace(mesh, points=points, tets=tets, quality=replace(mesh.quality, volume=volume, repairs=notes))


def refuse_too_many(shape: Shape, size: float, time: ProcessorTime, path: str) -> None:
    """Refuse a mesh that would exceed the limit of processor time on any machine, before the time is spent."""
    nodes = expected_nodes(shape, size)
    if nodes > time.nodes:
        least, limit = smallest_size(shape, int(time.nodes)), time.limit * nodes / time.nodes
        raise ShotError(
            f"its mesh would have about {nodes:.1e} nodes, too many for {time.limit:g} s of processor time",
            path=path, attribute="calm:flexible:elementSize", found=f"{size:.3g} m",
            remedy=f"Author at least {least:.2g} m" + MORE_TIME.format(limit),
        )  # fmt: skip


def refuse_loose_parts(tets: np.ndarray, path: str) -> None:
    count = connected_parts(tets)
    if count > 1:
        raise ShotError(
            "its tetrahedra are not connected", path=path, found=f"{count} separate parts",
            remedy="Make the parts overlap or touch, or split them into several bodies",
        )  # fmt: skip


def on_grid(index: int, body: Body, solid: Solid, shape: Shape, size: float, nodes: int) -> FEMesh | None:
    """A mesh of a grid, as close to a solid as a number of nodes allows; None where no grid is fine enough for any.

    Args:
        index: Of the body in its character.
        body: For the path in messages.
        solid: Closed.
        shape: Of the solid.
        size: Wanted edge length of the elements [m].
        nodes: Of ten-node tetrahedra at most, on walls that are not thin.
    """
    least = smallest_size(shape, nodes) / GRID
    spacing = max(min(size / GRID, _GRID_WALL * shape.thickness), least)
    best: FEMesh | None = None
    while True:
        try:
            points, tets = grid_tets(solid.points, solid.triangles, spacing)
            points = fitted(points, tets, solid.points, solid.triangles, _MOVED * spacing)  # with its edges
        except ValueError:
            pass
        else:
            quality = measure_quality(points, tets, surface_volume=solid.volume, repairs=solid.repairs)
            if best is None or quality.volume_error < best.quality.volume_error:
                best = FEMesh(index, points, tets, quality)
        if spacing <= least or (best is not None and best.quality.volume_error <= _NEAR_VOLUME):
            return best
        spacing = max(_FINER * spacing, least)


def grid_note(mesh: FEMesh, reason: str, followed: bool) -> str:
    """Message about a mesh of a grid; `followed`: whether elements of the wanted size were possible."""
    edges = mesh.points[mesh.tets[:, [0, 0, 0, 1, 1, 2]]] - mesh.points[mesh.tets[:, [1, 2, 3, 2, 3, 3]]]
    length = float(np.median(np.linalg.norm(edges, axis=2)))
    finer = "; author a smaller calm:flexible:elementSize to follow more" if followed else ""
    return (
        f"meshed on a grid with elements of {1e3 * length:.2g} mm, since {reason}: details and walls that are thinner "
        f"are missing, {100.0 * mesh.quality.volume_error:.2g}% of its volume{finer}"
    )
