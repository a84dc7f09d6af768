"""A depth-buffered renderer of triangles, which needs neither a screen nor a graphics card, and their normals."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, IntArray
from calmotion.support.compilation import kernel

CREASE = np.cos(np.radians(40.0))


def split_at_creases(points: Array, triangles: IntArray) -> tuple[IntArray, IntArray, Array]:
    """Copy each point once for each smooth group of faces around it.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].

    Returns:
        The point each copy comes from, shape [c]; the triangles in terms of the copies, shape [m, 3]; unit normals
        of the copies, shape [c, 3].
    """
    corners = points[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(area, axis=1)
    unit = area / np.maximum(length, 1e-300)[:, None]
    around: list[list[tuple[int, int]]] = [[] for _ in range(len(points))]
    for face, triangle in enumerate(triangles.tolist()):
        for slot, point in enumerate(triangle):
            around[point].append((face, slot))
    sources: list[int] = []
    normals: list[Array] = []
    split = np.empty_like(triangles)
    for point, uses in enumerate(around):
        faces = [face for face, _ in uses]
        near = unit[faces] @ unit[faces].T > CREASE
        groups: list[set[int]] = []
        for k in range(len(uses)):
            touching = [g for g in groups if any(near[k, other] for other in g)]
            groups = [g for g in groups if g not in touching] + [{k}.union(*touching)]
        for group in groups:
            total = area[[faces[k] for k in group]].sum(axis=0)
            for k in group:
                split[uses[k]] = len(sources)
            sources.append(point)
            normals.append(total / max(float(np.linalg.norm(total)), 1e-300))
    return np.array(sources, dtype=np.int32), split, np.array(normals).reshape(-1, 3)


CLOSE = 1e-9  # [pixels]: rounding, by which neighbours overlap rather than leave a gap


@dataclass(frozen=True, eq=False)
class Hits:
    """The visible triangle of each pixel.

    Attributes:
        triangle: Index of the triangle, -1 for none, shape [height, width].
        nearness: One over the distance, 0 for none, shape [height, width].
        corners: Of the triangles, as they were given.
    """

    triangle: IntArray
    nearness: NDArray[np.float32]
    corners: Array

    @property
    def filled(self) -> NDArray[np.bool_]:
        """Whether there is a triangle, shape [height, width]."""
        return self.triangle >= 0

    @property
    def depth(self) -> Array:
        """Distance, infinite for none, shape [height, width]."""
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.nearness.astype(float))


def rasterize(corners: Array, width: int, height: int, *, both_sides: bool = False, before: Hits | None = None) -> Hits:
    """Find the nearest triangle in each pixel.

    Args:
        corners: Pixel coordinates (x right, y down) and distance of the corners, shape [m, 3, 3].
        width, height: Size of the picture [pixels].
        both_sides: Whether triangles that face away (clockwise on an upright picture) are drawn as well.
        before: Hits of the first triangles of `corners`, which are there already; the others alone are drawn.

    Returns:
        The hits. Triangles with a corner behind the eye are not drawn.
    """
    given = np.ascontiguousarray(corners, dtype=float)
    if before is None:
        hits = Hits(np.full((height, width), -1, dtype=np.int32), np.zeros((height, width), dtype=np.float32), given)
        fill(given, 0, bool(both_sides), hits.triangle, hits.nearness)
        return hits
    hits = Hits(before.triangle.copy(), before.nearness.copy(), given)
    fill(given, len(before.corners), bool(both_sides), hits.triangle, hits.nearness)
    return hits


@kernel
def fill(corners: Array, first: int, both_sides: bool, triangle: IntArray, nearness: NDArray[np.float32]) -> None:
    """Write triangles, from the first one on, into the buffers of `Hits`, where one has a pixel's center, and is nearer
    than what is there."""
    height, width = triangle.shape
    for t in range(first, corners.shape[0]):
        ax, ay, az = corners[t, 0, 0], corners[t, 0, 1], corners[t, 0, 2]
        bx, by, bz = corners[t, 1, 0], corners[t, 1, 1], corners[t, 1, 2]
        cx, cy, cz = corners[t, 2, 0], corners[t, 2, 1], corners[t, 2, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if not (az > 0.0 and bz > 0.0 and cz > 0.0) or area == 0.0 or (area > 0.0 and not both_sides):
            continue  # with y down, a triangle that faces the eye has a negative area
        top, bottom = min(ay, by, cy), max(ay, by, cy)
        left, right = min(ax, bx, cx), max(ax, bx, cx)
        if not (top < height and bottom > 0.0 and left < width and right > 0.0):
            continue
        first_row, last_row = int(np.ceil(max(top, 0.0) - 0.5)), int(np.floor(min(bottom, height) - 0.5))
        # the shares of a and b are linear on the picture, and so is one over the distance
        a_x, a_y = (by - cy) / area, (cx - bx) / area
        b_x, b_y = (cy - ay) / area, (ax - cx) / area
        a_0, b_0 = (bx * cy - by * cx) / area, (cx * ay - cy * ax) / area
        step = a_x / az + b_x / bz - (a_x + b_x) / cz
        for row in range(max(first_row, 0), min(last_row, height - 1) + 1):
            y = row + 0.5
            a, b = a_0 + a_y * y, b_0 + b_y * y  # at x = 0
            low, high = max(left, 0.0), min(right, float(width))
            for constant, slope in ((a, a_x), (b, b_x), (1.0 - a - b, -a_x - b_x)):
                if slope > 0.0:
                    low = max(low, -constant / slope)
                elif slope < 0.0:
                    high = min(high, -constant / slope)
                elif constant < 0.0:
                    high = -1.0
            begin, end = int(np.ceil(low - 0.5 - CLOSE)), int(np.floor(high - 0.5 + CLOSE))
            at_zero = a / az + b / bz + (1.0 - a - b) / cz + 0.5 * step
            for column in range(max(begin, 0), min(end, width - 1) + 1):
                near = np.float32(at_zero + step * column)
                if near > nearness[row, column]:
                    nearness[row, column] = near
                    triangle[row, column] = t


@kernel
def barycentric(corners: Array, x: float, y: float) -> tuple[float, float]:
    """Shares of the first two corners of a triangle, shape [3, 3], at a pixel."""
    area = (corners[1, 0] - corners[0, 0]) * (corners[2, 1] - corners[0, 1])
    area -= (corners[1, 1] - corners[0, 1]) * (corners[2, 0] - corners[0, 0])
    a = (corners[1, 0] - x) * (corners[2, 1] - y) - (corners[1, 1] - y) * (corners[2, 0] - x)
    b = (corners[2, 0] - x) * (corners[0, 1] - y) - (corners[2, 1] - y) * (corners[0, 0] - x)
    return a / area, b / area
