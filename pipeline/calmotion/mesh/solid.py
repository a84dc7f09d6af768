"""The solid of a body whose geometry needs no repair, and its mass properties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, Indices
from calmotion.errors import ShotError
from calmotion.mesh.surfaces.closed_surfaces import winding_number
from calmotion.mesh.tetrahedra import boundary_triangles, oriented_tets, surface_volume
from calmotion.model.character import Body, MassProperties, SurfaceMesh

_FLAT = 1e-9  # volume of a component without volume, of the cube of its size


@dataclass(frozen=True, eq=False)
class Solid:
    """A body's material.

    Attributes:
        points: [m], shape [n, 3], body frame.
        triangles: Its closed surface, outward; that of cavities inward, shape [m, 3].
        mass: Mass properties of its material.
    """

    points: Array
    triangles: Indices
    mass: MassProperties


def solid_of(body: Body) -> Solid | None:
    """The solid of a flexible body, with the mass of its finite elements up to the accuracy of their mesh.

    Authored tetrahedra take precedence over surfaces, as for the mesh. A `mass` of the body scales the density.

    Returns:
        None where the solid is not known without meshing: the body is not flexible, its geometry is in a file, hollow
        or not its visual surface, it has no density, or its surfaces are not one closed outward component with
        cavities.
    """
    settings = body.flexible
    if settings is None or (settings.mesh_file and body.tets is None):
        return None
    if body.tets is None and (settings.wall_thickness > 0.0 or settings.geometry in ("collision", "beam")):
        return None
    surface = _outside(body)
    if surface is None or not settings.material.density > 0.0:
        return None
    points, triangles = surface
    parts = _components(triangles)
    if parts is None or not _is_one_solid(points, triangles, parts):
        return None
    mass = None if body.mass is None else body.mass.mass
    return Solid(points, triangles, mass_of_solid(points, triangles, settings.material.density, mass))


def mass_of_solid(points: Array, triangles: Indices, density: float, mass: float | None = None) -> MassProperties:
    """Mass properties of the inside of a closed surface, exact.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3], outward, those of cavities inward.
        density: [kg/m^3].
        mass: Total mass to which the density is scaled [kg]; None keeps the density.

    Source: as of `mesh_mass.mass_of_tets`, over the signed tetrahedra of the triangles and one point.
    """
    middle = points.mean(axis=0)  # against cancellation far from the origin
    corners = (points - middle)[triangles]
    volume = np.linalg.det(corners) / 6.0
    weight = volume * (density if mass is None else mass / float(volume.sum()))
    total = float(weight.sum())
    center = weight @ corners.sum(axis=1) / (4.0 * total)
    sums = corners.sum(axis=1)
    second = np.einsum("e,eki,ekj->ij", weight, corners, corners) + np.einsum("e,ei,ej->ij", weight, sums, sums)
    second = second / 20.0 - total * np.outer(center, center)
    return MassProperties(total, middle + center, np.trace(second) * np.eye(3) - second)


def _outside(body: Body) -> tuple[Array, Indices] | None:
    """Points, merged where they coincide, and triangles of a body; None where they are not valid."""
    if body.tets is not None:
        try:
            tets, _ = oriented_tets(body.tets.points, body.tets.tets)
        except ShotError:  # the mesher reports it
            return None
        return _welded(np.asarray(body.tets.points, dtype=float), boundary_triangles(tets))
    surfaces = _without_copies(body.surfaces)
    if not surfaces:
        return None
    joined = joined_surfaces(surfaces)
    return None if joined is None else _welded(*joined)


def joined_surfaces(surfaces: Sequence[SurfaceMesh]) -> tuple[Array, Indices] | None:
    """Points and triangles of surfaces with triangles, at least one; None where a triangle has a point that is not
    there."""
    counts = [len(surface.points) for surface in surfaces]
    offsets = np.cumsum([0, *counts[:-1]])
    for surface, count in zip(surfaces, counts, strict=True):
        if surface.triangles.min() < 0 or surface.triangles.max() >= count:
            return None
    triangles = np.vstack([surface.triangles + offset for surface, offset in zip(surfaces, offsets, strict=True)])
    return np.vstack([surface.points for surface in surfaces]), triangles


def _welded(points: Array, triangles: Indices) -> tuple[Array, Indices] | None:
    used = np.unique(triangles)
    if not np.isfinite(points[used]).all():
        return None
    merged, same = np.unique(points[used], axis=0, return_inverse=True)
    corners = same.reshape(-1)[np.searchsorted(used, triangles)]
    flat = (corners == np.roll(corners, 1, axis=1)).any(axis=1)
    return (merged, corners[~flat]) if not flat.all() else None


def _without_copies(surfaces: Sequence[SurfaceMesh]) -> list[SurfaceMesh]:
    """Surfaces with triangles, without copies of other ones, which collision geometry often contains."""
    kept: list[SurfaceMesh] = []
    for surface in surfaces:
        copied = any(
            np.array_equal(surface.points, other.points) and np.array_equal(surface.triangles, other.triangles)
            for other in kept
        )
        if len(surface.triangles) and not copied:
            kept.append(surface)
    return kept


def _components(triangles: Indices) -> Indices | None:
    """Index of the connected component of each triangle; None unless each edge has two consistent triangles."""
    start, end = triangles.ravel().astype(np.int64), np.roll(triangles, -1, axis=1).ravel().astype(np.int64)
    count = int(triangles.max()) + 1
    forward, backward = start * count + end, end * count + start
    there, back = np.argsort(forward), np.argsort(backward)
    keys = forward[there]
    if not np.array_equal(keys, backward[back]) or (np.diff(keys) == 0).any():
        return None
    neighbour = np.empty((len(triangles), 3), dtype=np.int64)
    neighbour.ravel()[there] = back // 3
    label = np.arange(len(triangles))
    while True:
        least = np.minimum(label, label[neighbour].min(axis=1))
        np.minimum.at(least, label, least.copy())  # all triangles of the label so far
        least = least[least]
        if np.array_equal(least, label):
            return np.unique(label, return_inverse=True)[1].reshape(-1)
        label = least


def _is_one_solid(points: Array, triangles: Indices, parts: Indices) -> bool:
    """Whether one component faces outward and all others are cavities within it."""
    outer: list[Indices] = []
    cavities: list[Indices] = []
    for k in range(int(parts.max()) + 1):
        component = triangles[parts == k]
        corners = points[np.unique(component)]
        volume = surface_volume(corners, np.searchsorted(np.unique(component), component))
        if abs(volume) <= _FLAT * float(np.linalg.norm(np.ptp(corners, axis=0))) ** 3:
            return False
        (outer if volume > 0.0 else cavities).append(component)
    if len(outer) != 1:
        return False
    return all(winding_number(points[cavity[0, 0]], points, outer[0]) > 0.5 for cavity in cavities)
