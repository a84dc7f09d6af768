"""Bridges across gaps between solids, such as those between parts of a CAD assembly."""

from collections.abc import Sequence
from typing import Any

import manifold3d
import numpy as np
from scipy.spatial import cKDTree

from calmotion.arrays import box_diagonal
from calmotion.mesh.repair.closing import Part, connected_pieces
from calmotion.mesh.repair.uniting import manifold_of, part_of
from calmotion.mesh.sources.sampling import sampled
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles, unit_normals

NARROW = 2e-3  # gap across which triangles that face each other are joined, of the size of the body
_SINK = 0.05  # overlap of a bridge with both sides, of the gap
_SAMPLES = 4_000  # places on a solid between which a strut is sought
_RADIUS, _SLENDER = 0.02, 0.3  # least radius of a strut, of the size and of the gap
_APART, _REACH = 0.5, 0.1  # how far a second strut is from the first, of the extent; widest gap there, of the size


def bridged(solids: Sequence[Part]) -> tuple[Part | None, float]:
    """The union of solids across narrow gaps, and the widest of these gaps.

    Each triangle that faces another solid across a narrow gap is extruded to a prism up to that solid.

    Args:
        solids: Disjoint, outward, in units of the size of the body.

    Returns:
        None instead of the union where it is not connected.
    """
    prisms: list[np.ndarray] = []
    widest = 0.0
    for k, solid in enumerate(solids):
        x = solid.points[solid.triangles]
        normals, _ = unit_normals(x)
        for other in [other for i, other in enumerate(solids) if i != k]:
            gaps, _ = NearbyTriangles(other.points, other.triangles, NARROW).faced(x.mean(axis=1), normals, 1e-7)
            for i in np.flatnonzero(gaps <= NARROW):
                gap, normal = float(gaps[i]), normals[i]
                widest = max(widest, gap)
                sink = _SINK * gap + 1e-7
                prisms.append(np.vstack([x[i] - sink * normal, x[i] + (gap + sink) * normal]))
    if not prisms:
        return None, 0.0
    made = [manifold3d.Manifold.hull_points(np.ascontiguousarray(prism)) for prism in prisms]
    whole = manifold3d.Manifold.batch_boolean([*(manifold_of(s) for s in solids), *made], manifold3d.OpType.Add)
    part = part_of(whole)
    return (part if len(_solids(part)) == 1 else None), widest


def strutted(solids: Sequence[Part]) -> tuple[Part, float]:
    """The union of solids across gaps of any width, by struts between the nearest places of each and of the largest.

    A solid that is held at one end by what was invented would swing on it, as a rod in the legs of Barkour in their
    second and third mode: it gets another strut at its other end.

    Args:
        solids: Disjoint, outward, in units of the size of the body, the largest first.

    Returns:
        The union, and the widest gap.
    """
    places, normals = (list(values) for values in zip(*(sampled(solid, _SAMPLES) for solid in solids), strict=True))
    whole, widest, struts = [0], 0.0, []
    left = list(range(1, len(solids)))
    while left:
        tree = cKDTree(np.vstack([places[k] for k in whole]))
        distances, found = zip(*(tree.query(places[k]) for k in left), strict=True)
        nearest = int(np.argmin([d.min() for d in distances]))
        k, gaps, facing = left[nearest], distances[nearest], tree.data[found[nearest]]
        i = int(gaps.argmin())
        widest = max(widest, float(gaps[i]))
        ends = [i]
        far = np.linalg.norm(places[k] - places[k][i], axis=1) > _APART * box_diagonal(places[k])
        if far.any() and gaps[far].min() < _REACH:
            ends.append(int(np.flatnonzero(far)[gaps[far].argmin()]))
        for end in ends:
            gap = float(gaps[end])
            near = [(places[k], normals[k], places[k][end]), *((places[j], normals[j], facing[end]) for j in whole)]
            struts.append(_strut(near, gap))
        whole.append(k)
        left.remove(k)
    united = manifold3d.Manifold.batch_boolean([*(manifold_of(s) for s in solids), *struts], manifold3d.OpType.Add)
    return part_of(united), widest


def _strut(near: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], gap: float) -> Any:
    """The hull of places within a radius of a center on either side of a gap, and below them.

    Args:
        near: Places and outward normals on a solid, shape [n, 3], and the center, for both sides.
        gap: Between the centers.
    """
    radius, corners = max(_RADIUS, _SLENDER * gap), []
    for points, outward, center in near:
        inside = np.linalg.norm(points - center, axis=1) <= radius
        corners += [points[inside], points[inside] - (_SINK * gap + 1e-4) * outward[inside]]
    return manifold3d.Manifold.hull_points(np.ascontiguousarray(np.vstack(corners)))


def _solids(part: Part) -> list[Part]:
    return [piece for piece in connected_pieces(part.points, part.triangles) if piece.volume > 1e-12]
