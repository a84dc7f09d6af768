"""Tetrahedra that fill a solid, within a limit of processor time."""

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import box_diagonal
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

# Largest error of a volume that is not told, and the largest that is accepted. The boundary of the mesh is fitted to
# the surface afterwards, which takes most of the error away.
MAX_VOLUME_ERROR, _ACCEPTED = 0.01, 0.05
# Detail that is removed, of the envelope, which the mesh does not resolve; more of it from surfaces that are dense
# still: fTetWild takes some 2 ms for each triangle, and many times as much where the envelope is narrow.
_DETAIL, _DENSE_DETAIL = 0.1, 0.5
# What is more detailed gets as many triangles, and a wider envelope: of that which others have, and of the thickness of
# walls. The boundary of the mesh is fitted to the surface afterwards.
_TRIANGLES, _WIDER, _OF_WALL = 3_000, 4.0, 0.4
# Shares of what is left of the time, for the mesh and for coarser ones where it takes too long
_SHARES = (0.4, 0.5, 1.0)
_TRIANGLE = 3e-3  # processor time for a triangle of a surface with many details [s]; 2 to 3.3 ms were measured
_COARSER = 1.6  # factor of size and envelope of a mesh that follows one which took too long
_SMALLER, _CLOSER = 0.8, 0.5  # the same of one that follows a mesh with a large error of its volume
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
        notes: What is said about the mesh.
    """

    points: np.ndarray
    triangles: np.ndarray
    size: float
    distance: float
    detailed: bool = False
    notes: tuple[str, ...] = ()


def filled(
    index: int, body: Body, solid: Solid, shape: Shape, size: float, time: ProcessorTime, use_cache: bool = True,
    longer: float = 1.0,
) -> FEMesh:  # fmt: skip
    """Tetrahedra of uniform size that fill a solid.

    A surface with many details is simplified. Where a mesh takes too long, a coarser one is made. A mesh with a large
    error of its volume is followed by one that is closer to the surface; the better one counts, with its error.

    Args:
        index: Of the body in its character.
        body: For errors.
        solid: Closed.
        size: Edge length [m].
        time: Processor time of the body.
        use_cache: Whether the cache folder is used.
        longer: Factor of the edge length; the distance to the surface is that of the given one.

    Raises:
        OutOfTime: It cannot be meshed in time.
        ShotError: The solid cannot be meshed, or the tetrahedra do not fill it.
    """
    refuse_too_many(shape, size, time, body.path)
    made = _in_time(index, body, solid, shape, size, (1.0, longer), time, use_cache)
    if made.quality.volume_error > _ACCEPTED:
        with suppress(OutOfTime):
            closer = _in_time(index, body, solid, shape, _SMALLER * size, (_CLOSER, longer), time, use_cache)
            made = min(made, closer, key=lambda mesh: mesh.quality.volume_error)
    return _whole(_accepted(made, solid, body.path), body.path)


def _in_time(
    index: int, body: Body, solid: Solid, shape: Shape, size: float, factors: tuple[float, float], time: ProcessorTime,
    use_cache: bool,
) -> FEMesh:  # fmt: skip
    """The first of ever coarser meshes that does not take too long.

    Args:
        factors: Of the distance to the surface and of the edge length.
        index, body, solid, shape, size, time, use_cache: As of `filled`.

    Raises:
        OutOfTime: None does.
    """
    late: OutOfTime | None = None
    for number, share in enumerate(_SHARES):
        attempt = _attempt(solid, shape, size, factors, _COARSER**number)
        try:
            _refuse_hopeless(attempt, body.path, time)
            points, tets = _meshed(attempt, body.path, time, share, use_cache)
        except OutOfTime as error:
            late = error
            continue
        repairs = (*solid.repairs, *attempt.notes)
        return FEMesh(index, points, tets, measure_quality(points, tets, surface_volume=solid.volume, repairs=repairs))
    assert late is not None
    raise late


def _attempt(solid: Solid, shape: Shape, size: float, factors: tuple[float, float], coarser: float) -> _Attempt:
    """The surface of a solid without the detail that a mesh does not resolve, and how close a mesh comes to it.

    Args:
        solid, shape, size, factors: As of `_in_time`.
        coarser: Factor of the size and the distance, and of one over the number of triangles.
    """
    diagonal = box_diagonal(solid.points)
    closer, longer = factors
    narrow = coarser * closer * envelope(size, diagonal, shape, len(solid.triangles) if coarser == 1.0 else DENSE)
    points, triangles = simplified(solid, _DETAIL * narrow)
    most, distance, detailed = int(DENSE / coarser), narrow, False
    if len(triangles) > most:
        points, triangles = decimated(points, triangles, most, _DENSE_DETAIL * narrow)
    notes: tuple[str, ...] = ()
    if coarser > 1.0:
        notes = (f"meshed with elements {coarser:.2g} times as large, since smaller ones took too long",)
    if len(triangles) > most:
        distance, detailed = max(min(_WIDER * narrow, _OF_WALL * shape.thickness), narrow), True
        points, triangles = decimated(points, triangles, int(_TRIANGLES / coarser), distance)
        told = (
            f"simplified to {len(triangles)} triangles, since all {len(solid.triangles)} would take too long: details "
            f"of less than {1e3 * distance:.2g} mm are missing"
        )
        notes = (*notes, told)
    return _Attempt(points, triangles, coarser * longer * size, distance, detailed, notes)


def _refuse_hopeless(attempt: _Attempt, path: str, time: ProcessorTime) -> None:
    """Refuse a surface that is too detailed still, before the time is spent."""
    least = _TRIANGLE * len(attempt.triangles)
    if attempt.detailed and least > _SHARES[0] * time.limit:
        raise OutOfTime(
            "tetrahedralising would exceed the limit of processor time",
            path=path,
            found=f"{len(attempt.triangles)} triangles, {time.limit:g} s",
            remedy=REMEDY + MORE_TIME.format(np.ceil(least / _SHARES[0])),
        )


def _meshed(
    attempt: _Attempt, path: str, time: ProcessorTime, share: float, use_cache: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Tetrahedra that take no more than a share of what is left of the time."""
    part = time.part(share)
    # fTetWild measures distances by the diagonal of what it is given
    diagonal = box_diagonal(attempt.points)
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


def _accepted(mesh: FEMesh, solid: Solid, path: str) -> FEMesh:
    """The mesh, where its volume is that of the surface, or nearly so and the error is reported.

    A surface that intersects itself has another volume than what it winds around, which the mesh fills.
    """
    error = mesh.quality.volume_error
    if error <= _ACCEPTED:
        return mesh
    notes = mesh.quality.repairs
    wound = abs(mesh.quality.volume / enclosed_volume(solid.points, solid.triangles) - 1.0)
    if wound < 0.5 * error:
        error, notes = wound, (*notes, INTERSECTS)
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
