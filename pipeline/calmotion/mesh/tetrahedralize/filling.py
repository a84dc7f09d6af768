"""Tetrahedra that fill a solid, within a limit of processor time."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from calmotion.errors import ShotError
from calmotion.mesh.element_sizes import Shape, envelope, expected_nodes, smallest_size
from calmotion.mesh.repair.closed_solid import Solid, simplified
from calmotion.mesh.surfaces.closed_surfaces import enclosed_volume
from calmotion.mesh.surfaces.decimation import decimated
from calmotion.mesh.tetrahedra import (
    connected_parts,
    largest_part,
    measure_quality,
    oriented_tets,
    tet_volumes,
    without_contacts,
    without_unused_points,
)
from calmotion.mesh.tetrahedralize.tetwild import DENSE, MORE_TIME, REMEDY, OutOfTime, ProcessorTime, tetrahedralize
from calmotion.model import Body, FEMesh

# Wanted and largest allowed error. An error of half a percent of volume in thin walls is larger than that in a
# frequency. Where a better mesh would take too long, a larger error is accepted and reported.
_GOOD_VOLUME, MAX_VOLUME_ERROR, _ACCEPTED = 0.005, 0.01, 0.05
# Detail that is removed, of the envelope, which the mesh does not resolve; more of it from surfaces that are dense
# still: fTetWild takes some 2 ms for each triangle, and many times as much where the envelope is narrow.
_DETAIL, _DENSE_DETAIL = 0.1, 0.5
# What is more detailed gets as many triangles, and a wider envelope: of that which others have, and of the thickness of
# walls. The boundary of the mesh is fitted to the surface afterwards.
_TRIANGLES, _WIDER, _OF_WALL = 3_000, 4.0, 0.4
_ATTEMPTS = 3
# Share of the time for the first mesh: what is left is for a coarser one
_FIRST, _FIRST_DENSE = 0.6, 0.4
_LATE = 0.1  # share of the time after which an accepted mesh is not followed by a closer one
_TRIANGLE = 3e-3  # processor time for a triangle of a surface with many details [s]; 2 to 3.3 ms were measured
_COARSER = 1.6  # factor of size and envelope of a mesh that took too long
INTERSECTS = "its surface intersects itself: all that it encloses counts as solid"
_LOOSE = 0.05  # of the volume: parts that a thin connection, which the mesh did not follow, held


@dataclass(frozen=True, eq=False)
class _Attempt:
    """The surface that is meshed, and how.

    Attributes:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].
        size: Of the elements [m].
        distance: Of the mesh to the surface [m].
        detailed: Whether the surface has less detail than such a mesh could resolve.
    """

    points: np.ndarray
    triangles: np.ndarray
    size: float
    distance: float
    detailed: bool = False


def filled(
    index: int, body: Body, solid: Solid, shape: Shape, size: float, time: ProcessorTime, use_cache: bool = True,
    longer: float = 1.0,
) -> FEMesh:  # fmt: skip
    """Tetrahedra of uniform size that fill a solid.

    A surface with many details is simplified. Where a mesh takes most of the time, a coarser one is made. A mesh with
    an error of its volume is followed by one that is closer to the surface as long as there is time; the best one
    counts, with its error.

    Args:
        index: Of the body in its character.
        body: For errors.
        solid: Closed.
        size: Edge length [m].
        time: Processor time of the body.
        use_cache: Whether the cache folder is used.
        longer: Factor of the edge length on a surface with many details.

    Raises:
        OutOfTime: It cannot be meshed in time.
        ShotError: The solid cannot be meshed, or the tetrahedra do not fill it.
    """
    refuse_too_many(shape, size, time, body.path)
    volumes: list[float] = []
    best: FEMesh | None = None
    notes: tuple[str, ...] = ()
    begun, dense = time.used, len(solid.triangles) > DENSE
    for number in range(_ATTEMPTS):
        attempt = _attempt(solid, shape, size, number, longer)
        if best is not None and attempt.detailed:
            break
        try:
            _refuse_hopeless(attempt, body.path, time)
            points, tets = _meshed(attempt, body.path, time, _FIRST_DENSE if dense else _FIRST, use_cache)
        except OutOfTime:
            if best is not None:
                break
            made = None
            if dense and not attempt.detailed:
                count = len(attempt.triangles) // 2
                attempt = _detailed(attempt, solid, shape, size, longer, count)
                with suppress(OutOfTime):
                    made = _meshed(attempt, body.path, time, 0.5, use_cache)
            if made is None:
                if dense:  # as hopeless
                    raise
                made = _meshed(_coarser(solid, shape, attempt), body.path, time, 1.0, use_cache)
                notes = (f"meshed with elements {_COARSER:g} times as large, since smaller ones took too long",)
            points, tets = made
        if attempt.detailed:
            notes = (
                f"simplified to {len(attempt.triangles)} triangles, since all {len(solid.triangles)} would take too "
                f"long: details of less than {1e3 * attempt.distance:.2g} mm are missing",
            )
        quality = measure_quality(points, tets, surface_volume=solid.volume, repairs=(*solid.repairs, *notes))
        volumes.append(quality.volume)
        if best is None or quality.volume_error < best.quality.volume_error:
            best = FEMesh(index, points, tets, quality)
        # a mesh that is closer to the surface takes about twice as long
        late = time.used - begun > _LATE * time.limit and best.quality.volume_error <= _ACCEPTED
        enough = MAX_VOLUME_ERROR if number or dense else _GOOD_VOLUME
        if best.quality.volume_error <= enough or notes or late or attempt.detailed:
            break
        size *= 0.8 if best.quality.volume_error > MAX_VOLUME_ERROR else 1.0
    assert best is not None
    return _whole(_accepted(best, solid, volumes, body.path), body.path)


def _attempt(solid: Solid, shape: Shape, size: float, number: int, longer: float) -> _Attempt:
    """The surface of a solid without the detail that a mesh does not resolve, and how close a mesh comes to it.

    Args:
        number: 0 first; further ones come closer.
        solid, shape, size, longer: As of `filled`.
    """
    distance = envelope(size, _diagonal(solid.points), shape, len(solid.triangles), number)
    attempt = _Attempt(*simplified(solid, _DETAIL * distance), size, distance)
    if len(attempt.triangles) > DENSE:
        points, triangles = decimated(attempt.points, attempt.triangles, DENSE, _DENSE_DETAIL * distance)
        attempt = _Attempt(points, triangles, longer * size, distance)
    if len(attempt.triangles) > DENSE:
        return _detailed(attempt, solid, shape, size, longer, int(shape.detail * _TRIANGLES))
    return attempt


def _detailed(attempt: _Attempt, solid: Solid, shape: Shape, size: float, longer: float, count: int) -> _Attempt:
    """That of a surface whose details would take too long, with a number of triangles; the others as of `filled`."""
    narrow = envelope(size, _diagonal(solid.points), shape, len(solid.triangles), 0)
    distance = max(min(_WIDER / shape.detail * narrow, _OF_WALL * shape.thickness), narrow)
    points, triangles = decimated(attempt.points, attempt.triangles, count, distance)
    return _Attempt(points, triangles, longer * size, distance, detailed=True)


def _refuse_hopeless(attempt: _Attempt, path: str, time: ProcessorTime) -> None:
    """Refuse a surface that is too detailed still, before the time is spent."""
    least = _TRIANGLE * len(attempt.triangles)
    if attempt.detailed and least > _FIRST_DENSE * time.limit:
        raise OutOfTime(
            "tetrahedralising would exceed the limit of processor time",
            path=path,
            found=f"{len(attempt.triangles)} triangles, {time.limit:g} s",
            remedy=REMEDY + MORE_TIME.format(np.ceil(least / _FIRST_DENSE)),
        )


def _coarser(solid: Solid, shape: Shape, attempt: _Attempt) -> _Attempt:
    """That of a mesh that took too long, as far from the surface as one of many triangles is followed."""
    size = _COARSER * attempt.size
    distance = max(_COARSER * attempt.distance, envelope(size, _diagonal(solid.points), shape, DENSE, 0))
    points, triangles = simplified(solid, _DETAIL * distance)
    return _Attempt(points, triangles, size, distance)


def _diagonal(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _meshed(
    attempt: _Attempt, path: str, time: ProcessorTime, share: float, use_cache: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Tetrahedra that take no more than a share of what is left of the time."""
    part = time.part(share)
    # fTetWild measures distances by the diagonal of what it is given
    diagonal = _diagonal(attempt.points)
    try:
        made, tets = tetrahedralize(
            attempt.points, attempt.triangles, attempt.size, attempt.distance / diagonal, path, part, use_cache
        )
    except OutOfTime:
        time.used = part.limit
        raise
    time.used = part.used
    tets, _ = oriented_tets(made, tets, path)
    return without_unused_points(made, tets)


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
        notes = (*notes, INTERSECTS)
    if error > _ACCEPTED:
        raise ShotError(
            "the tetrahedra do not fill the surface",
            path=path,
            found=f"volume error {100.0 * error:.2g}%, allowed {100.0 * _ACCEPTED:.2g}%",
            remedy="Author a smaller calm:flexible:elementSize, repair the Mesh, or give a TetMesh or a mesh file",
        )
    return replace(mesh, quality=replace(mesh.quality, volume_error=error, repairs=notes))


def _whole(mesh: FEMesh, path: str) -> FEMesh:
    """The mesh without what a connection thinner than the distance to the surface made.

    Those are contacts in points and edges, and small parts that they held.
    """
    kept = largest_part(mesh.points, mesh.tets)
    if len(kept) < len(mesh.tets):
        volume = float(tet_volumes(mesh.points, kept).sum())
        lost = 1.0 - volume / mesh.quality.volume
        if lost > _LOOSE:
            refuse_loose_parts(mesh.tets, path)
        points, tets = without_unused_points(mesh.points, kept)
        notes = (*mesh.quality.repairs, f"removed loose parts of the mesh, {100.0 * lost:.2g}% of the volume")
        mesh = replace(mesh, points=points, tets=tets, quality=replace(mesh.quality, volume=volume, repairs=notes))
    points, tets = without_contacts(mesh.points, mesh.tets)
    return replace(mesh, points=points, tets=tets)


def refuse_too_many(shape: Shape, size: float, time: ProcessorTime, path: str) -> None:
    """Refuse a mesh that would exceed the limit of processor time on any machine, before the time is spent."""
    nodes = expected_nodes(shape, size)
    if nodes > time.nodes:
        least, limit = smallest_size(shape, int(time.nodes)), time.limit * nodes / time.nodes
        raise ShotError(
            f"its mesh would have about {nodes:.1e} nodes, too many for {time.limit:g} s of processor time",
            path=path,
            attribute="calm:flexible:elementSize",
            found=f"{size:.3g} m",
            remedy=f"Author at least {least:.2g} m" + MORE_TIME.format(limit),
        )


def refuse_loose_parts(tets: np.ndarray, path: str) -> None:
    count = connected_parts(tets)
    if count > 1:
        raise ShotError(
            "its tetrahedra are not connected",
            path=path,
            found=f"{count} separate parts",
            remedy="Make the parts overlap or touch, or split them into several bodies",
        )
