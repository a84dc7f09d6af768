"""Mass of a body filled with linear tetrahedra, or bounded by a closed surface."""

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array, Indices, IntArray
from calmotion.mesh.moments import surface_moments, tetrahedron_moments
from calmotion.mesh.parts import Makeup
from calmotion.mesh.tetrahedra import tet_volumes
from calmotion.model.character import Body, MassProperties, SurfaceMesh

_OFF = 0.1  # of a radius of gyration, by which a centre of mass may be elsewhere
_OTHER = 1.3  # ratio of radii of gyration that is told
_HOLLOW = 0.7  # of the mass of a solid of the material, below which a body may be hollow


def mass_of_tets(
    points: Array, tets: IntArray, density: float, mass: float | None = None, makeup: Makeup | None = None
) -> MassProperties:
    """Mass properties of tetrahedra, exact.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], of either orientation.
        density: [kg/m^3].
        mass: Total mass to which the density is scaled [kg]; None keeps the density.
        makeup: Of a body of several materials; each tetrahedron has its mean density.
    """
    volume = np.abs(tet_volumes(points, tets))
    moments = tetrahedron_moments(points[tets], volume if makeup is None else volume * makeup.density)
    return moments.mass_properties(density if mass is None else mass / moments.volume)


def mass_of_solid(points: Array, triangles: Indices, density: float, mass: float | None = None) -> MassProperties:
    """Mass properties of the inside of a closed surface, exact.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3], outward, those of cavities inward.
        density, mass: As of `mass_of_tets`.
    """
    moments = surface_moments(points, triangles)
    return moments.mass_properties(density if mass is None else mass / moments.volume)


def joined_surfaces(surfaces: Sequence[SurfaceMesh]) -> tuple[Array, IntArray] | None:
    """Points and triangles of surfaces with triangles, at least one; None where a triangle has a point that is not
    there."""
    counts = [len(surface.points) for surface in surfaces]
    offsets = np.cumsum([0, *counts[:-1]])
    for surface, count in zip(surfaces, counts, strict=True):
        if surface.triangles.min() < 0 or surface.triangles.max() >= count:
            return None
    triangles = np.vstack([surface.triangles + offset for surface, offset in zip(surfaces, offsets, strict=True)])
    return np.vstack([surface.points for surface in surfaces]), triangles


def density_note(body: Body, volume: float, same: float) -> tuple[str, ...]:
    """Message about a stated mass that is not that of the solid and its material; the density follows the mass.

    Args:
        body: Any.
        volume: Of its solid [m^3].
        same: Relative difference that is not told.
    """
    if body.mass is None or body.flexible is None:
        return ()
    material = body.flexible.material
    if material.core is not None or material.parts:
        return ()  # theirs is told with what they are made of
    ratio = body.mass.mass / (material.density * volume)
    if abs(ratio - 1.0) <= same:
        return ()
    note = (
        f"the shot states a mass of {body.mass.mass:.3g} kg, {ratio:.2g} times that of its volume and material: "
        f"its density is {material.density * ratio:.4g} instead of {material.density:.4g} kg/m^3"
    )
    return (note + ("; if it is hollow, author calm:flexible:wallThickness" if ratio < _HOLLOW else ""),)


def balance_note(body: Body, own: MassProperties) -> tuple[str, ...]:
    """Message about a centre of mass or an inertia that is not that of the solid, over which the mass is spread.

    Args:
        body: Any.
        own: Of its solid.
    """
    stated = body.mass
    if stated is None or body.flexible is None:
        return ()
    away = float(np.linalg.norm(own.center - stated.center))
    turns, theirs = (float(np.sqrt(np.trace(m.inertia) / (2.0 * m.mass))) for m in (own, stated))
    ratio = turns / theirs if theirs > 0.0 else np.inf
    if away <= _OFF * turns and 1.0 / _OTHER <= ratio <= _OTHER:
        return ()
    return (
        f"its mass is spread evenly over the solid: the centre is {1e3 * away:.3g} mm from that of the shot's mass, "
        f"the radius of gyration {1e3 * turns:.3g} instead of {1e3 * theirs:.3g} mm; heavy parts, such as motors, are "
        "best bodies of their own, which fixed joints hold",
    )
