"""Slits of a solid: thin gaps between two sides of its surface that face each other, and bodies that fill them."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from calmotion.arrays import Array, Indices
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles, unit_normals

_OPPOSITE = -0.85  # largest product of the normals of two sides: within 32 degrees; else they are those of a corner
_SMOOTH = 0.8  # least product of the normals of triangles with an edge in common that have one filling
_UPRIGHT = 0.3  # least product of the normals of a triangle and of the far side of its filling
_ROUNDING = 1e-3  # of the widest slit: how far behind a place the other side may be
_LATERAL = 2.0  # way of a corner, of that along the normals of its triangles


def slit_widths(places: Array, normals: Array, triangles: Array, widest: float) -> Array:
    """Widths of the slits across which places of a surface face another side of it [m], shape [n]; infinite for none.

    Args:
        places: [m], shape [n, 3].
        normals: Outward, unit vectors, shape [n, 3].
        triangles: Surface [m], shape [k, 3, 3], outward.
        widest: Slit [m].
    """
    corners = triangles.reshape(-1, 3)
    near = NearbyTriangles(corners, np.arange(len(corners)).reshape(-1, 3), widest)
    gap, product = near.faced(places, normals, _ROUNDING * widest)
    return np.asarray(np.where((gap <= widest) & (product < _OPPOSITE), gap, np.inf))


@dataclass(frozen=True, eq=False)
class Filling:
    """A closed body in a slit.

    Attributes:
        points: [m], shape [n, 3].
        triangles: Outward, shape [m, 3].
        width: Of the slit, the largest one at the middle of a triangle [m].
    """

    points: Array
    triangles: Indices
    width: float


def slit_fillings(
    points: Array, triangles: Indices, widest: float, sink: float, beside: float = 0.0, least: float = 0.0
) -> list[Filling]:
    """Bodies that fill the slits of a solid, one for each smooth part of a side.

    Where the middle of a triangle faces another side across a gap, it is extruded up to there. A part of a triangle
    does not count: large ones are divided before.

    Args:
        points: [m], shape [n, 3].
        triangles: Closed and outward, shape [m, 3].
        widest: Gap that is filled [m].
        sink: How far a filling reaches into both sides [m].
        beside: How far a filling reaches beyond its triangles, so that it meets the next one around a bend [m].
        least: Area of a part below which it is left open [m^2].
    """
    x = points[triangles]
    normal, area = unit_normals(x)
    nearby = NearbyTriangles(points, triangles, 2.0 * widest)
    gap, product = nearby.faced(x.mean(axis=1), normal, sink)
    chosen = np.flatnonzero((gap <= widest) & (product < _OPPOSITE) & (area > 0.0))
    fillings = []
    for part in _smooth_parts(triangles, normal, chosen):
        if area[part].sum() < least:
            continue
        corners, faces = np.unique(triangles[part], return_inverse=True)
        faces = faces.reshape(-1, 3)
        up = _directions(points[corners], faces, normal[part], area[part])
        height = _heights(nearby, points[corners], up, faces, gap[part], sink)
        upper = points[corners] + (height + sink)[:, None] * up
        # where a slit is narrower than it is curved, as in a hole, triangles would turn over
        upright = np.einsum("tx,tx->t", unit_normals(upper[faces])[0], normal[part]) > _UPRIGHT
        if upright.any():
            lower, faces = points[corners] - sink * up, faces[upright]
            aside = beside * _outward(lower, up, faces)
            body = _closed(lower + aside, upper + aside, faces)
            fillings.append(Filling(*body, float(gap[part][upright].max())))
    return fillings


def _smooth_parts(triangles: Indices, normal: Array, chosen: Indices) -> list[Indices]:
    """Chosen triangles, by parts that are connected by edges without a bend."""
    edges = np.sort(triangles[chosen][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    keys = edges[:, 0].astype(np.int64) * (int(triangles.max(initial=0)) + 1) + edges[:, 1]
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    a, b = order[same] // 3, order[same + 1] // 3
    smooth = np.einsum("ex,ex->e", normal[chosen[a]], normal[chosen[b]]) > _SMOOTH
    graph = coo_matrix((np.ones(smooth.sum()), (a[smooth], b[smooth])), shape=(len(chosen), len(chosen)))
    count, label = connected_components(graph, directed=False)
    order = np.argsort(label, kind="stable")
    return np.split(chosen[order], np.cumsum(np.bincount(label, minlength=count))[:-1]) if count else []


def _directions(corners: Array, faces: Indices, normal: Array, area: Array) -> Array:
    """The way of each corner out of the side, which is longer than one where its triangles bend; shape [n, 3]."""
    up = np.zeros_like(corners)
    for corner in faces.T:
        np.add.at(up, corner, area[:, None] * normal)
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), np.finfo(float).tiny)
    least = np.ones(len(corners))
    for corner in faces.T:
        np.minimum.at(least, corner, np.einsum("tx,tx->t", up[corner], normal))
    return np.asarray(up / np.maximum(least, 1.0 / _LATERAL)[:, None])


def _heights(nearby: NearbyTriangles, corners: Array, up: Array, faces: Indices, gap: Array, sink: float) -> Array:
    """Gaps at corners, at least those at the middles of their triangles; shape [n]."""
    height = np.zeros(len(corners))
    for corner in faces.T:
        np.maximum.at(height, corner, gap)
    length = np.linalg.norm(up, axis=1)
    found, product = nearby.faced(corners, up / length[:, None], sink)
    seen = np.isfinite(found) & (product < _OPPOSITE)
    return np.asarray(np.where(seen, np.maximum(height, found / length), height))


def _border(faces: Indices, count: int) -> Indices:
    """Edges of one triangle alone, in its direction, shape [k, 2]; of triangles with a number of corners."""
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
    inner = np.isin(edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0])
    return np.asarray(edges[~inner])


def _outward(corners: Array, up: Array, faces: Indices) -> Array:
    """Unit vectors along the side and away from its triangles, at their border; zero elsewhere; shape [n, 3]."""
    a, b = _border(faces, len(corners)).T
    away = np.cross(corners[b] - corners[a], up[a])
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), np.finfo(float).tiny)
    sums = np.zeros_like(corners)
    np.add.at(sums, a, away)
    np.add.at(sums, b, away)
    return np.asarray(sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), np.finfo(float).tiny))


def _closed(lower: Array, upper: Array, faces: Indices) -> tuple[Array, Indices]:
    """The body between two sides of the same triangles."""
    n = len(lower)
    a, b = _border(faces, n).T
    walls = np.vstack([np.stack([a, b, b + n], axis=1), np.stack([a, b + n, a + n], axis=1)])
    used, triangles = np.unique(np.vstack([faces[:, ::-1], faces + n, walls]), return_inverse=True)
    return np.vstack([lower, upper])[used], triangles.reshape(-1, 3)
