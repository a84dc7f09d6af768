"""Triangulation of polygons: fans for convex polygons, ear clipping for others."""

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray

_TURN = 1e-6  # sine of the angle by which a corner may turn back in a polygon that counts as convex


def triangulate(points: Array, counts: IntArray, corners: IntArray, keep: BoolArray) -> IntArray:
    """Triangles of polygons, with the orientation of the polygons.

    Convex polygons are cut into fans; polygons with a reflex corner by ear clipping, since a fan would overlap itself.

    Args:
        points: Shape [n, 3].
        counts: Corners of each polygon, shape [p].
        corners: Point of each corner, shape [sum of counts].
        keep: Which polygons are wanted, bool, shape [p]; those with fewer than three corners are never.

    Returns:
        Shape [m, 3].
    """
    first = np.cumsum(counts) - counts
    cut = np.where(keep & (counts >= 3), counts - 2, 0)  # triangles of each polygon
    fans = np.repeat(np.arange(len(counts)), cut)
    step = np.arange(len(fans)) - np.repeat(np.cumsum(cut) - cut, cut)
    base = first[fans]
    triangles = np.stack([corners[base], corners[base + step + 1], corners[base + step + 2]], axis=1).astype(np.int32)
    begin = np.cumsum(cut) - cut
    for polygon in _with_reflex_corner(points, counts, corners, first, cut > 1):
        ring = corners[first[polygon] : first[polygon] + counts[polygon]]
        triangles[begin[polygon] : begin[polygon] + cut[polygon]] = _ears(points[ring], ring)
    return triangles


def _with_reflex_corner(
    points: Array, counts: IntArray, corners: IntArray, first: IntArray, wanted: BoolArray
) -> IntArray:
    """Polygons of more than three corners with a reflex corner."""
    polygon = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(corners)) - first[polygon]
    following = first[polygon] + (place + 1) % counts[polygon]
    before = first[polygon] + (place - 1) % counts[polygon]
    x = points[corners]
    toward, away = x - x[before], x[following] - x
    turn = np.cross(toward, away)
    normal = np.zeros((len(counts), 3))
    np.add.at(normal, polygon, np.cross(x - x[first[polygon]], x[following] - x[first[polygon]]))
    size = np.linalg.norm(toward, axis=1) * np.linalg.norm(away, axis=1) * np.linalg.norm(normal, axis=1)[polygon]
    back = np.einsum("ij,ij->i", turn, normal[polygon]) < -_TURN * size
    return np.unique(polygon[back & wanted[polygon]])


def _ears(x: Array, ring: IntArray) -> IntArray:
    """Triangles of one polygon that is about flat and does not cross itself, shape [corners - 2, 3].

    Source: Meisters 1975, Polygons have ears.
    """
    normal = np.cross(x - x[0], np.roll(x, -1, axis=0) - x[0]).sum(axis=0)
    axis = np.linalg.svd(normal[None])[2][1:]
    axis[1] *= np.sign(np.cross(axis[0], axis[1]) @ normal) or 1.0
    p = x @ axis.T
    left = list(range(len(p)))
    ears: list[list[int]] = []
    while len(left) > 3:
        k = next(
            (k for k in range(len(left)) if _is_ear(p, left, k)), 0
        )  # 0: the polygon crosses itself and has no valid triangulation
        ears.append([left[k - 1], left[k], left[(k + 1) % len(left)]])
        del left[k]
    ears.append(left)
    triangles: IntArray = ring[np.array(ears)]
    return triangles


def _is_ear(p: Array, left: list[int], k: int) -> bool:
    a, b, c = p[left[k - 1]], p[left[k]], p[left[(k + 1) % len(left)]]
    if _side(a, b, c) <= 0.0:
        return False
    others = p[[i for i in left if not any(np.array_equal(p[i], q) for q in (a, b, c))]]
    inside = (_side(a, b, others) >= 0.0) & (_side(b, c, others) >= 0.0) & (_side(c, a, others) >= 0.0)
    return not np.any(inside)


def _side(a: Array, b: Array, c: Array) -> Array:
    """Twice the area of the triangles a b c, positive to the left of a b."""
    areas: Array = (b[0] - a[0]) * (c[..., 1] - a[1]) - (b[1] - a[1]) * (c[..., 0] - a[0])
    return areas
