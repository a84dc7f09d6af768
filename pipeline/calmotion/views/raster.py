"""A depth-buffered renderer of triangles, which needs neither a screen nor a graphics card."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, IntArray
from calmotion.support.compilation import kernel


@dataclass(frozen=True, eq=False)
class Hits:
    """The visible triangle of each pixel.

    Attributes:
        triangle: Index of the triangle, -1 for none, shape [height, width].
        shares: Barycentric coordinates in it on the picture, shape [height, width, 2]; the third is one minus both.
        depth: Distance, infinite for none, shape [height, width].
    """

    triangle: IntArray
    shares: NDArray[np.float32]
    depth: Array

    @property
    def filled(self) -> NDArray[np.bool_]:
        """Whether there is a triangle, shape [height, width]."""
        return self.triangle >= 0


def rasterize(corners: Array, width: int, height: int, *, both_sides: bool = False) -> Hits:
    """Find the nearest triangle in each pixel.

    Args:
        corners: Pixel coordinates (x right, y down) and distance of the corners, shape [m, 3, 3].
        width, height: Size of the picture [pixels].
        both_sides: Whether triangles that face away (clockwise on an upright picture) are drawn as well.

    Returns:
        The hits. Triangles with a corner behind the eye are not drawn.
    """
    hits = Hits(
        np.full((height, width), -1, dtype=np.int32),
        np.zeros((height, width, 2), dtype=np.float32),
        np.full((height, width), np.inf),
    )
    given = np.ascontiguousarray(corners, dtype=float)
    fill(given, bool(both_sides), hits.triangle, hits.shares, hits.depth)
    return hits


@kernel
def fill(corners: Array, both_sides: bool, triangle: IntArray, shares: NDArray[np.float32], depth: Array) -> None:
    """Write the triangles into the buffers of `Hits`, each pixel where its center is inside one that is nearer."""
    height, width = triangle.shape
    for t in range(corners.shape[0]):
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
        first, last = int(np.ceil(max(left, 0.0) - 0.5)), int(np.floor(min(right, width) - 0.5))
        for row in range(max(first_row, 0), min(last_row, height - 1) + 1):
            y = row + 0.5
            for column in range(max(first, 0), min(last, width - 1) + 1):
                x = column + 0.5
                a = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                b = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                c = 1.0 - a - b
                if a < 0.0 or b < 0.0 or c < 0.0:
                    continue
                distance = 1.0 / (a / az + b / bz + c / cz)  # its inverse is linear on the picture
                if distance < depth[row, column]:
                    depth[row, column] = distance
                    triangle[row, column] = t
                    shares[row, column, 0] = a
                    shares[row, column, 1] = b
