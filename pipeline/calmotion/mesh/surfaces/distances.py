"""Distances between points and triangles: closest points and rays; solid angles of triangles."""

import numpy as np

from calmotion.arrays import Array, BoolArray, Indices
from calmotion.support.compilation import kernel


def triangle_parts(count: int) -> Array:
    """Barycentric coordinates of the centers of count^2 equal parts of a triangle, shape [count^2, 3]."""
    points = []
    for i in range(count):
        for j in range(count - i):
            points.append((i + 1 / 3, j + 1 / 3))
            if i + j < count - 1:
                points.append((i + 2 / 3, j + 2 / 3))
    first = np.array(points) / count
    return np.column_stack([first, 1.0 - first.sum(axis=1)])


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
    # the foot of the perpendicular is nearer than any edge where it is inside the triangle
    n = np.cross(b - a, c - a)
    area2 = np.einsum("ij,ij->i", n, n)
    good = area2 > 0.0
    safe = np.where(good, area2, 1.0)
    foot = point - n * (np.einsum("ij,ij->i", point - a, n) / safe)[:, None]
    v = np.einsum("ij,ij->i", np.cross(foot - a, c - a), n) / safe
    w = np.einsum("ij,ij->i", np.cross(b - a, foot - a), n) / safe
    inside = good & (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)
    closest[inside] = foot[inside]
    return np.asarray(closest)


def _closest_on_segments(point: Array, a: Array, b: Array) -> Array:
    d = b - a
    length2 = np.maximum(np.einsum("ij,ij->i", d, d), np.finfo(float).tiny)
    t = np.clip(np.einsum("ij,ij->i", point - a, d) / length2, 0.0, 1.0)
    return np.asarray(a + t[:, None] * d)


def meets_plane(triangles: Array, origin: Array, normal: Array) -> BoolArray:
    """Which triangles a plane meets, shape [k].

    Args:
        triangles: Corners [m], shape [k, 3, 3].
        origin: A point of the plane [m], shape [3].
        normal: Of the plane, shape [3].
    """
    found = np.empty(len(triangles), dtype=np.bool_)
    _meets_plane(np.ascontiguousarray(triangles), np.ascontiguousarray(origin), np.ascontiguousarray(normal), found)
    return found


@kernel
def _meets_plane(triangles: Array, origin: Array, normal: Array, found: BoolArray) -> None:
    offset = normal[0] * origin[0] + normal[1] * origin[1] + normal[2] * origin[2]
    for k in range(len(triangles)):
        low, high = np.inf, -np.inf
        for i in range(3):
            p = triangles[k, i]
            height = normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2] - offset
            low, high = min(low, height), max(high, height)
        found[k] = low <= 0.0 and high >= 0.0


def ray_length(origin: Array, direction: Array, triangles: Array, skip: float) -> float:
    """Distance along a ray to the first triangle that is farther than `skip`; infinite without one.

    Args:
        origin: [m], shape [3].
        direction: Unit vector, shape [3].
        triangles: Corners [m], shape [k, 3, 3].
        skip: [m]; nearer hits are on the surface where the ray starts.
    """
    start, way = np.ascontiguousarray(origin), np.ascontiguousarray(direction)
    return float(first_hit(start, way, np.ascontiguousarray(triangles), float(skip)))


@kernel
def first_hit(origin: Array, direction: Array, triangles: Array, skip: float) -> float:
    """`ray_length` of contiguous arrays.

    Source: Möller and Trumbore 1997.
    """
    nearest = np.inf
    d0, d1, d2 = direction[0], direction[1], direction[2]
    for k in range(len(triangles)):
        a, b, c = triangles[k, 0], triangles[k, 1], triangles[k, 2]
        e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        f0, f1, f2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        p0, p1, p2 = d1 * f2 - d2 * f1, d2 * f0 - d0 * f2, d0 * f1 - d1 * f0
        det = e0 * p0 + e1 * p1 + e2 * p2
        scale = np.sqrt((e0 * e0 + e1 * e1 + e2 * e2) * (f0 * f0 + f1 * f1 + f2 * f2))
        if not abs(det) > 1e-12 * scale:
            continue
        s0, s1, s2 = origin[0] - a[0], origin[1] - a[1], origin[2] - a[2]
        # triangles are slightly enlarged: a ray along an edge must not pass between two of them
        u = (s0 * p0 + s1 * p1 + s2 * p2) / det
        if u < -1e-9 or u > 1.0 + 1e-9:
            continue
        q0, q1, q2 = s1 * e2 - s2 * e1, s2 * e0 - s0 * e2, s0 * e1 - s1 * e0
        v = (d0 * q0 + d1 * q1 + d2 * q2) / det
        t = (f0 * q0 + f1 * q1 + f2 * q2) / det
        if v >= -1e-9 and u + v <= 1.0 + 1e-9 and skip < t < nearest:
            nearest = t
    return nearest


@kernel
def solid_angles(
    places: Array, corners: Array, bounds: Indices, dipoles: Array, middles: Array, reach: Array, angles: Array
) -> None:
    """Solid angles of grouped triangles at places; a place farther than its reach sees a group as a dipole.

    Args:
        places: Shape [k, 3].
        corners: Shape [m, 3, 3], in the order of their groups.
        bounds: First triangle of each group, and m, shape [g + 1].
        dipoles: Sum of the area vectors of each group, shape [g, 3].
        middles: Center of each group, shape [g, 3].
        reach: Shape [g].
        angles: The result, shape [k].
    """
    for k in range(len(places)):
        px, py, pz = places[k, 0], places[k, 1], places[k, 2]
        total = 0.0
        for g in range(len(reach)):
            x, y, z = middles[g, 0] - px, middles[g, 1] - py, middles[g, 2] - pz
            distance = np.sqrt(x * x + y * y + z * z)
            if distance > reach[g]:
                total += (dipoles[g, 0] * x + dipoles[g, 1] * y + dipoles[g, 2] * z) / distance**3
                continue
            for t in range(bounds[g], bounds[g + 1]):
                ax, ay, az = corners[t, 0, 0] - px, corners[t, 0, 1] - py, corners[t, 0, 2] - pz
                bx, by, bz = corners[t, 1, 0] - px, corners[t, 1, 1] - py, corners[t, 1, 2] - pz
                cx, cy, cz = corners[t, 2, 0] - px, corners[t, 2, 1] - py, corners[t, 2, 2] - pz
                la = np.sqrt(ax * ax + ay * ay + az * az)
                lb = np.sqrt(bx * bx + by * by + bz * bz)
                lc = np.sqrt(cx * cx + cy * cy + cz * cz)
                det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
                rest = la * lb * lc + (ax * bx + ay * by + az * bz) * lc
                rest += (bx * cx + by * cy + bz * cz) * la + (cx * ax + cy * ay + cz * az) * lb
                total += 2.0 * np.arctan2(det, rest)
        angles[k] = total
