"""What of a surface is near many points, by a grid of cells that name the triangles close to them."""

from functools import cached_property

import numpy as np

from calmotion.arrays import Array, Indices
from calmotion.support.compilation import kernel

_CELLS = 64  # along the longest side of the surface
_EDGE = 1e-9  # of an edge, by which a triangle is larger for rays: none must pass between two of them
_ROUNDING = 1e-12  # of a squared distance, and of the size of the surface: what is farther than that is not closer
_NO_AREA = 1e-13  # square of the sine of an angle below which a triangle is a line


class NearbyTriangles:
    """The triangles of a surface, by cells of space.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].
        reach: Triangles farther than this from a point are not found [m]; also an attribute.
    """

    def __init__(self, points: Array, triangles: Indices, reach: float):
        self._corners = np.ascontiguousarray(points[triangles])
        self.reach = reach
        low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
        self._low, self._size = low, float((high - low).max()) / _CELLS
        self._count = np.maximum(np.ceil((high - low) / self._size).astype(np.int64), 1)
        self._boxes = np.stack([self._corners.min(axis=1), self._corners.max(axis=1)], axis=1)
        first = ((self._boxes[:, 0] - reach - low) / self._size).astype(np.int64)
        last = ((self._boxes[:, 1] + reach - low) / self._size).astype(np.int64)
        first, last = np.clip(first, 0, self._count - 1), np.clip(last, 0, self._count - 1)
        self._start = np.zeros(int(np.prod(self._count)) + 1, np.int64)
        _list(first, last, self._count, self._start, np.zeros(0, np.int32))
        np.cumsum(self._start, out=self._start)
        self._listed = np.zeros(self._start[-1], np.int32)
        _list(first, last, self._count, self._start, self._listed)

    def closest(self, points: Array) -> Array:
        """Closest points of the surface [m], shape [k, 3]; NaN where it is farther than the reach."""
        found = np.full(points.shape, np.nan)
        near = np.ascontiguousarray(points)
        cells = self._cells(points)
        bounds = (self.reach, _ROUNDING * self._size * _CELLS)
        _closest(near, cells, self._start, self._listed, self._corners, self._boxes, bounds, np.zeros(3), found)
        return found

    def faced(self, points: Array, directions: Array, skip: float) -> tuple[Array, Array]:
        """The first side towards each point that a ray meets from there.

        Args:
            points: [m], shape [k, 3].
            directions: Unit vectors, shape [k, 3].
            skip: How far behind the point a side may be, whose distance is zero then [m].

        Returns:
            Distances [m], shape [k], infinite beyond the reach; and the product of the direction and the normal of what
            is met, shape [k], from -1 where it is met straight on.
        """
        x, normal = self._corners, self._normals
        distance, product = np.full(len(points), np.inf), np.zeros(len(points))
        origins, ways = np.ascontiguousarray(points), np.ascontiguousarray(directions)
        bounds = (self.reach, skip)
        _faced(origins, ways, self._cells(points), self._start, self._listed, x, normal, bounds, distance, product)
        return distance, product

    @cached_property
    def _normals(self) -> Array:
        return unit_normals(self._corners)[0]

    def _cells(self, points: Array) -> Indices:
        """The cell of each point, -1 where it is outside of all; shape [k]."""
        cell = np.floor((points - self._low) / self._size).astype(np.int64)
        inside = np.all((cell >= 0) & (cell < self._count), axis=1)
        number = (cell[:, 0] * self._count[1] + cell[:, 1]) * self._count[2] + cell[:, 2]
        number[~inside] = -1
        return np.asarray(number)


def unit_normals(x: Array) -> tuple[Array, Array]:
    """Unit normals of triangles, shape [m, 3], and their areas, shape [m], from their corners, shape [m, 3, 3]."""
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    doubled = np.linalg.norm(normal, axis=1)
    return normal / np.maximum(doubled, np.finfo(float).tiny)[:, None], 0.5 * doubled


@kernel
def _list(first: Indices, last: Indices, count: Indices, start: Indices, listed: Indices) -> None:
    """Count the triangles of each cell into start[cell + 1]; or, with cumulative counts, list them.

    `start` is the same before and after a listing.
    """
    for k in range(len(first) - 1, -1, -1):
        for x in range(first[k, 0], last[k, 0] + 1):
            for y in range(first[k, 1], last[k, 1] + 1):
                for z in range(first[k, 2], last[k, 2] + 1):
                    cell = (x * count[1] + y) * count[2] + z
                    if len(listed) == 0:
                        start[cell + 1] += 1
                    else:
                        start[cell + 1] -= 1
                        listed[start[cell + 1]] = k
    if len(listed) > 0:
        # each start[cell + 1] has fallen to the beginning of its cell: back by one place
        for cell in range(len(start) - 1):
            start[cell] = start[cell + 1]
        start[len(start) - 1] = len(listed)


@kernel
def _closest(
    points: Array, cell: Indices, start: Indices, listed: Indices, corners: Array, boxes: Array,
    bounds: tuple[float, float], p: Array, found: Array,
) -> None:  # fmt: skip
    """Closest points; the triangle of the last one, and boxes around triangles, tell early which are farther."""
    last, (reach, rounding) = -1, bounds
    for k in range(len(points)):
        if cell[k] < 0:
            continue
        nearest = reach * reach
        if last >= 0:
            apart = _apart(points[k], boxes[last])  # the closest point of a sliver may be wrong, and out of its box
            there = max(_squared_distance(points[k], corners[last], p), apart)
            nearest = min(nearest, (1.0 + _ROUNDING) * there + rounding**2) if apart <= nearest else nearest
        for at in range(start[cell[k]], start[cell[k] + 1]):
            triangle = listed[at]
            if _apart(points[k], boxes[triangle]) > (1.0 + _ROUNDING) * nearest + rounding**2:
                continue
            distance = _squared_distance(points[k], corners[triangle], p)
            if distance <= nearest:
                nearest, last = distance, triangle
                for i in range(3):
                    found[k, i] = p[i]


@kernel
def _faced(
    points: Array, directions: Array, cell: Indices, start: Indices, listed: Indices, corners: Array, normals: Array,
    bounds: tuple[float, float], distance: Array, product: Array,
) -> None:  # fmt: skip
    reach, skip = bounds
    for k in range(len(points)):
        if cell[k] < 0:
            continue
        p, d, nearest = points[k], directions[k], reach
        for at in range(start[cell[k]], start[cell[k] + 1]):
            a, n = corners[listed[at], 0], normals[listed[at]]
            facing = n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
            if facing >= 0.0:
                continue
            along = (n[0] * (a[0] - p[0]) + n[1] * (a[1] - p[1]) + n[2] * (a[2] - p[2])) / facing
            if along < -skip or along >= nearest:
                continue
            if _contains(corners[listed[at]], n, p[0] + along * d[0], p[1] + along * d[1], p[2] + along * d[2]):
                nearest = max(along, 0.0)
                distance[k], product[k] = nearest, facing


@kernel
def _contains(corners: Array, n: Array, x: float, y: float, z: float) -> bool:
    """Whether a place in the plane of a triangle of unit normal n is in it, or on its edge within rounding."""
    for i in range(3):
        a, b = corners[i], corners[(i + 1) % 3]
        e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        r0, r1, r2 = x - a[0], y - a[1], z - a[2]
        side = n[0] * (e1 * r2 - e2 * r1) + n[1] * (e2 * r0 - e0 * r2) + n[2] * (e0 * r1 - e1 * r0)
        if side < -_EDGE * (e0 * e0 + e1 * e1 + e2 * e2):
            return False
    return True


@kernel
def _apart(point: Array, box: Array) -> float:
    """Squared distance of a point from a box, given by its lowest and its highest corner [m^2]."""
    apart = 0.0
    for i in range(3):
        apart += max(box[0, i] - point[i], point[i] - box[1, i], 0.0) ** 2
    return apart


@kernel
def _squared_distance(point: Array, corners: Array, out: Array) -> float:
    """Of a point from a triangle [m^2]; the closest point is written into `out`."""
    closest_on_triangle(point, corners, out)
    distance = 0.0
    for i in range(3):
        distance += (out[i] - point[i]) ** 2
    return distance


@kernel
def _closest_on_edges(point: Array, corners: Array, out: Array) -> None:
    """Closest point of the edges of a triangle without area, some of which may be points."""
    nearest = np.inf
    for k in range(3):
        last = (k + 1) % 3
        along, length = 0.0, 0.0
        for i in range(3):
            along += (point[i] - corners[k, i]) * (corners[last, i] - corners[k, i])
            length += (corners[last, i] - corners[k, i]) ** 2
        share = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
        distance = 0.0
        for i in range(3):
            distance += (corners[k, i] + share * (corners[last, i] - corners[k, i]) - point[i]) ** 2
        if distance < nearest:
            nearest = distance
            for i in range(3):
                out[i] = corners[k, i] + share * (corners[last, i] - corners[k, i])


@kernel
def closest_on_triangle(point: Array, corners: Array, out: Array) -> None:
    """Closest point of a triangle, corners of shape [3, 3], into `out`, shape [3].

    Source: Ericson, Real-Time Collision Detection, 5.1.5.
    """
    d1, d2, d3, d4, d5, d6, ee, ff = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        e, f = corners[1, i] - corners[0, i], corners[2, i] - corners[0, i]
        a, b, c = point[i] - corners[0, i], point[i] - corners[1, i], point[i] - corners[2, i]
        d1 += e * a
        d2 += f * a
        d3 += e * b
        d4 += f * b
        d5 += e * c
        d6 += f * c
        ee += e * e
        ff += f * f
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v, w = 0.0, 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        v = 1.0
    elif d6 >= 0.0 and d5 <= d6:
        w = 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0 and d1 > d3:
        v = d1 / (d1 - d3)
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0 and d2 > d6:
        w = d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0 and (d4 - d3) + (d5 - d6) > 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    elif va + vb + vc > _NO_AREA * ee * ff:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    else:
        _closest_on_edges(point, corners, out)
        return
    for i in range(3):
        out[i] = (1.0 - v - w) * corners[0, i] + v * corners[1, i] + w * corners[2, i]
