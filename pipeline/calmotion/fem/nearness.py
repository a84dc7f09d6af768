"""Distances between points and triangles: closest points and rays."""

from __future__ import annotations

import numpy as np

from ..shot.character import Array


def closest_on_triangles(point: Array, triangles: Array) -> Array:
    """Closest point of each triangle to one point.

    Args:
        point: [m], shape [3].
        triangles: Corners [m], shape [k, 3, 3].

    Returns:
        [m], shape [k, 3].

    Source: Ericson, Real-Time Collision Detection, 5.1.5 (regions of the triangle's plane), vectorised.
    """
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    candidates = np.stack([_closest_on_segments(point, p, q) for p, q in ((a, b), (b, c), (c, a))], axis=1)
    nearest = np.linalg.norm(candidates - point, axis=-1).argmin(axis=1)
    closest = candidates[np.arange(len(a)), nearest]
    # the foot of the perpendicular, where it falls inside the triangle, is nearer than any edge
    n = np.cross(b - a, c - a)
    area2 = np.einsum("ij,ij->i", n, n)
    good = area2 > 0.0
    safe = np.where(good, area2, 1.0)
    foot = point - n * (np.einsum("ij,ij->i", point - a, n) / safe)[:, None]
    v = np.einsum("ij,ij->i", np.cross(foot - a, c - a), n) / safe
    w = np.einsum("ij,ij->i", np.cross(b - a, foot - a), n) / safe
    inside = good & (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)
    closest[inside] = foot[inside]
    return closest


def _closest_on_segments(point: Array, a: Array, b: Array) -> Array:
    d = b - a
    length2 = np.maximum(np.einsum("ij,ij->i", d, d), np.finfo(float).tiny)
    t = np.clip(np.einsum("ij,ij->i", point - a, d) / length2, 0.0, 1.0)
    return a + t[:, None] * d


def ray_length(origin: Array, direction: Array, triangles: Array, skip: float) -> float:
    """Distance along a unit direction to the first triangle that is farther than `skip`; infinite without one.

    Args:
        origin, direction: Shape [3].
        triangles: Corners [m], shape [k, 3, 3].
        skip: [m]; hits nearer than this are the surface that the ray starts on.

    Source: Möller and Trumbore 1997, vectorised.
    """
    a = triangles[:, 0]
    e1, e2 = triangles[:, 1] - a, triangles[:, 2] - a
    p = np.cross(direction, e2)
    det = np.einsum("ij,ij->i", e1, p)
    scale = np.linalg.norm(e1, axis=1) * np.linalg.norm(e2, axis=1)
    good = np.abs(det) > 1e-12 * scale
    inverse = 1.0 / np.where(good, det, 1.0)
    s = origin - a
    u = np.einsum("ij,ij->i", s, p) * inverse
    q = np.cross(s, e1)
    v = (q @ direction) * inverse
    t = np.einsum("ij,ij->i", e2, q) * inverse
    # a slight widening: a ray along an edge must not slip between its two triangles
    hit = good & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (t > skip)
    return float(t[hit].min()) if hit.any() else np.inf
