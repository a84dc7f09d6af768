"""Solid angles of many triangles at many places."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, Indices
from calmotion.support.compilation import kernel


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
