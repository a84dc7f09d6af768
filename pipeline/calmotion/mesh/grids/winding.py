"""How often a closed surface winds around the corners of a grid: positive inside."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, Indices
from calmotion.support.compilation import inlined_kernel, kernel

_ASIDE = (0.31830989, 0.36787944)  # of a thousandth of the spacing: rays do not run along edges of CAD surfaces


def wound(points: Array, triangles: Indices, low: Array, counts: Array, spacing: float) -> Array:
    """How often a surface winds around each corner of a grid: signed crossings of rays along x.

    Args:
        points: Of the surface [m], shape [n, 3].
        triangles: Shape [m, 3], closed.
        low: First corner of the grid, which may be anywhere [m], shape [3].
        counts: Corners along each axis, shape [3].
        spacing: [m].

    Returns:
        Shape `counts`; where the surface goes on behind the grid, the last corners along x are wrong.
    """
    changes = np.zeros(tuple(counts), np.int32)
    start = low + 1e-3 * spacing * np.array([0.0, *_ASIDE])
    _count(np.ascontiguousarray(points[triangles]), start, spacing, changes)
    return np.cumsum(changes, axis=0)


@inlined_kernel
def projected_area(x: Array) -> float:
    """Twice the area of a triangle seen along x, positive where its corners turn left, shape [3, 3]."""
    return float((x[1, 1] - x[0, 1]) * (x[2, 2] - x[0, 2]) - (x[1, 2] - x[0, 2]) * (x[2, 1] - x[0, 1]))


@inlined_kernel
def ray_crossing(x: Array, area: float, y: float, z: float) -> float:
    """Where a ray along x at y and z crosses a triangle with this `projected_area`; NaN where it passes by."""
    u = ((x[1, 1] - y) * (x[2, 2] - z) - (x[1, 2] - z) * (x[2, 1] - y)) / area
    v = ((x[2, 1] - y) * (x[0, 2] - z) - (x[2, 2] - z) * (x[0, 1] - y)) / area
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        return np.nan
    return float(u * x[0, 0] + v * x[1, 0] + (1.0 - u - v) * x[2, 0])


@kernel
def _count(corners: Array, low: Array, spacing: float, changes: Array) -> None:
    """Add -1 or 1 to the first corner of the grid behind each crossing of a ray along x with a triangle."""
    for t in range(len(corners)):
        x = corners[t]
        area = projected_area(x)
        if area == 0.0:
            continue
        y0, y1 = min(x[0, 1], x[1, 1], x[2, 1]) - low[1], max(x[0, 1], x[1, 1], x[2, 1]) - low[1]
        z0, z1 = min(x[0, 2], x[1, 2], x[2, 2]) - low[2], max(x[0, 2], x[1, 2], x[2, 2]) - low[2]
        for j in range(max(int(np.ceil(y0 / spacing)), 0), min(int(y1 / spacing) + 1, changes.shape[1])):
            y = low[1] + spacing * j
            for k in range(max(int(np.ceil(z0 / spacing)), 0), min(int(z1 / spacing) + 1, changes.shape[2])):
                z = low[2] + spacing * k
                crossing = ray_crossing(x, area, y, z)
                if np.isnan(crossing):
                    continue
                i = min(max(int(np.ceil((crossing - low[0]) / spacing)), 0), changes.shape[0] - 1)
                changes[i, j, k] += -1 if area > 0.0 else 1
