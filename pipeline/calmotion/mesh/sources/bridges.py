"""Bridges across gaps between solids, such as those between parts of a CAD assembly."""

from collections.abc import Sequence
from typing import Any

import manifold3d
import numpy as np
from scipy.spatial import cKDTree

from calmotion.arrays import Array, Indices, box_diagonal
from calmotion.mesh.repair.closing import Part, concatenated, connected_pieces
from calmotion.mesh.repair.uniting import NotManifold, manifold_of, part_of
from calmotion.mesh.sources.sampling import sampled
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles, unit_normals

NARROW = 2e-3  # gap across which triangles that face each other are joined, of the size of the body
_SINK = 0.05  # overlap of a bridge with both sides, of the gap
_FLAT = 1.0 - 1e-6  # product of the normals of triangles of one flat patch
_VOID = 1e-4  # of the volume, smallest void between solids that stays
_SAMPLES = 4_000  # places on a solid between which a strut is sought
_RADIUS, _SLENDER = 0.02, 0.3  # least radius of a strut, of the size and of the gap
_APART, _REACH = 0.5, 0.1  # how far a second strut is from the first, of the extent; widest gap there, of the size


def bridged(solids: Sequence[Part]) -> tuple[Part | None, float]:
    """The union of solids across narrow gaps, and the widest of these gaps.

    Each flat patch that faces another solid across a narrow gap is extruded up to that solid.

    Args:
        solids: Disjoint, outward, in units of the size of the body.

    Returns:
        None instead of the union where it is not connected.
    """
    made: list[Any] = []
    widest = 0.0
    for k, solid in enumerate(solids):
        x = solid.points[solid.triangles]
        normals, _ = unit_normals(x)
        for other in [other for i, other in enumerate(solids) if i != k]:
            gaps, _ = NearbyTriangles(other.points, other.triangles, NARROW).faced(x.mean(axis=1), normals, 1e-7)
            facing = np.flatnonzero(gaps <= NARROW)
            for flat in _flat_patches(solid.triangles[facing], normals[facing]):
                patch = facing[flat]
                gap, normal = float(gaps[patch].max()), normals[patch[0]]
                widest = max(widest, gap)
                made += _extruded(solid.points, solid.triangles[patch], normal, gap)
    if not made:
        return None, 0.0
    whole = manifold3d.Manifold.batch_boolean([*(manifold_of(s) for s in solids), *made], manifold3d.OpType.Add)
    united = part_of(whole)
    pieces = connected_pieces(united.points, united.triangles)
    if sum(piece.volume > 1e-12 for piece in pieces) != 1:
        return None, widest
    # what bridges shut in beside each other is no cavity of the robot
    return concatenated([piece for piece in pieces if abs(piece.volume) > _VOID * pieces[0].volume]), widest


def _flat_patches(triangles: Indices, normals: Array) -> list[Indices]:
    """The sets of triangles that edges connect and that have one normal."""
    from trimesh.graph import connected_components, face_adjacency  # takes half a second, and most links have no gaps

    pairs = face_adjacency(triangles)
    pairs = pairs[np.einsum("ij,ij->i", normals[pairs[:, 0]], normals[pairs[:, 1]]) > _FLAT]
    return list(connected_components(pairs, nodes=np.arange(len(triangles))))


def _extruded(points: Array, triangles: Indices, normal: Array, gap: float) -> list[Any]:
    """A flat patch extruded across a gap, and a little into the solids on both sides."""
    used, corners = np.unique(triangles, return_inverse=True)
    below, above = corners.reshape(-1, 3)[:, ::-1], corners.reshape(-1, 3) + len(used)
    edges = above[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    a, b = edges[first[count == 1]].T
    sides = np.concatenate([np.stack([b, a, a - len(used)], 1), np.stack([b, a - len(used), b - len(used)], 1)])
    sink = _SINK * gap + 1e-7
    places = np.concatenate([points[used] - sink * normal, points[used] + (gap + sink) * normal])
    try:
        return [manifold_of(Part(places, np.concatenate([below, above, sides])))]
    except NotManifold:  # more than two triangles at an edge
        prisms = places[np.concatenate([below, above], axis=1)]
        return [manifold3d.Manifold.hull_points(np.ascontiguousarray(prism)) for prism in prisms]


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
