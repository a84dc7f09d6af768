"""Which part of a body holds a place, and what of each tetrahedron is in which part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array, Indices, IntArray
from calmotion.mesh.surfaces.closed_surfaces import winding_numbers
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import surface_volume
from calmotion.model.materials.parts import Part

# Near the corners and in the middle of a tetrahedron: where all are in one part, all of it is taken for that
_PROBES = np.vstack([np.full((4, 4), 0.02) + 0.92 * np.eye(4), np.full((1, 4), 0.25)])
_REACH = 0.02  # of the size of all parts: how exactly the nearest part of a place in none is known


def holders(places: Array, parts: Sequence[Part]) -> Indices:
    """Index of the part that holds each place, shape [k].

    Where several do, the one with the least volume: an insert is inside the shell around it. Where none does, as in
    the struts that join separate parts, the nearest one.

    Args:
        places: [m], shape [k, 3].
        parts: At least one.
    """
    found = np.full(len(places), -1)
    for index in np.argsort([-abs(surface_volume(part.points, part.triangles)) for part in parts], kind="stable"):
        part = parts[index]
        corners = part.points[part.triangles].reshape(-1, 3)
        near = np.flatnonzero(((places >= corners.min(axis=0)) & (places <= corners.max(axis=0))).all(axis=1))
        if len(near):
            wound = np.abs(winding_numbers(places[near], part.points, part.triangles)) > 0.5
            found[near[wound]] = index
    size = float(np.linalg.norm(np.ptp(np.vstack([part.points[part.triangles.ravel()] for part in parts]), axis=0)))
    left = np.flatnonzero(found < 0)
    if len(left):
        found[left] = _nearest(places[left], parts, _REACH * size)
    return found


def _nearest(places: Array, parts: Sequence[Part], reach: float) -> Indices:
    """Index of the part with the nearest surface, shape [k]; beyond reach, of that with the nearest corner."""
    from scipy.spatial import cKDTree

    least, found = np.full(len(places), np.inf), np.zeros(len(places), np.int64)
    for index, part in enumerate(parts):
        closest = NearbyTriangles(part.points, part.triangles, reach).closest(places)
        away = np.linalg.norm(closest - places, axis=1)
        far = np.isnan(away)
        if far.any():
            away[far] = reach + cKDTree(part.points[np.unique(part.triangles)]).query(places[far])[0]
        found[away < least] = index
        least = np.minimum(least, away)
    return found


def part_of_places(points: Array, tets: IntArray, parts: Sequence[Part], places: Array) -> Indices:
    """Index of the part at places in tetrahedra, shape [e, p].

    Args:
        points: Corners [m], shape [n, 3].
        tets: Shape [e, 4].
        parts: At least one.
        places: Barycentric coordinates, shape [p, 4].
    """
    probed = holders(np.einsum("pc,eci->epi", _PROBES, points[tets]).reshape(-1, 3), parts).reshape(len(tets), -1)
    found = np.repeat(probed[:, -1:], len(places), axis=1)
    mixed = np.flatnonzero((probed != probed[:, :1]).any(axis=1))
    if len(mixed):
        at = np.einsum("pc,eci->epi", places, points[tets[mixed]]).reshape(-1, 3)
        found[mixed] = holders(at, parts).reshape(len(mixed), -1)
    return found
