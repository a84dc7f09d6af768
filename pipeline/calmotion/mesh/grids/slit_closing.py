"""A solid whose narrow slits are closed, from a grid: a wrap that is as tight everywhere.

Fillings of single slits (`mesh/surfaces/slits.py`) leave the rest of a surface as it is, and many triangles where
shells are in each other. Here the surface is made anew from what a ball cannot enter from outside: it has no slits
that are narrower, and its sharp edges are cut off within a part of the spacing.

Source: closing by a structuring element, Serra 1982, Image Analysis and Mathematical Morphology.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, Indices
from calmotion.mesh.grids.level_sets import grid_about, zero_surface
from calmotion.mesh.grids.winding import wound
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles

CLOSED = 2.0  # spacings: gaps that are always closed; of those up to three, some
_SQUARED = 2  # largest squared distance of a corner of the grid from the middle of the ball
_NEAR = 1.8  # spacings: the diagonal of a cell
_LEAST = 0.02  # of the spacing: corners of the grid count as no nearer to the surface, which has no flat triangles so


def closed_slits(points: Array, triangles: Indices, spacing: float) -> tuple[Array, Indices]:
    """The surface of a solid with its slits and holes of up to two spacings closed, and some of up to three.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3], closed, outward; what they wind around is solid.
        spacing: Of the grid [m]; it has some (size / spacing)^3 corners.

    Returns:
        Points [m], shape [k, 3], and triangles, shape [l, 3], closed and outward, some seven for each cell of the
        grid on the surface.
    """
    from scipy.ndimage import binary_closing

    aside = 2.5 * spacing
    low = points.min(axis=0) - aside
    counts = np.ceil((points.max(axis=0) + aside - low) / spacing).astype(np.int64) + 1
    inside = wound(points, triangles, low, counts, spacing) > 0
    ball = (np.mgrid[-1:2, -1:2, -1:2] ** 2).sum(axis=0) <= _SQUARED
    closed = binary_closing(inside, ball) | inside
    used, at, tets = grid_about(closed, low, spacing)
    near = NearbyTriangles(points, triangles, _NEAR * spacing).closest(at)
    distance = np.nan_to_num(np.linalg.norm(at - near, axis=1), nan=0.5 * spacing)
    # what is added is not bounded by the surface that is near: it ends half a spacing behind its last corner
    filled, solid = closed.ravel()[used], inside.ravel()[used]
    distance[filled & ~solid] = 0.5 * spacing
    depth = np.where(filled, 1.0, -1.0) * np.clip(distance, _LEAST * spacing, spacing)
    return zero_surface(at, depth, tets)
