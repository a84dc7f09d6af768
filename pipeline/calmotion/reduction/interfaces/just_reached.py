"""Which parts of the surface within the sphere of an interface patch a joint does not hold.

A sphere that is as large as what is next to a joint may also end on another wall: the bottom of a fork whose cheeks
carry a pin, or the other side of a shell. How much of that wall is within the sphere is chance, and depends on a
thousandth of the radius: holding it, a fork of the G1 had 320, 346 or 307 Hz on three meshes, in place of 207 Hz.
"""

from __future__ import annotations

import numpy as np

from calmotion.geometry.distances import closest_on_triangles
from calmotion.geometry.tetrahedra import Indices, part_of_each
from calmotion.shot.character import Array, BoolArray

_ON = 1e-9  # of the radius: triangles that end on the sphere
# Nearest place of a part, from the nearest of all (0) to the sphere (1). On nine robots, second cheeks and the sides
# of bores are at most at 0.7, walls that a sphere just reaches mostly at 0.9 and more.
_FARTHEST = 0.75


def just_reached(points: Array, triangles: Indices, center: Array, radius: float, beyond: float = _ON) -> BoolArray:
    """Triangles of parts that a sphere just reaches, and that a joint in its center does not hold, shape [k].

    Args:
        points: Of the surface [m], shape [n, 3].
        triangles: Shape [k, 3].
        center: [m], shape [3].
        radius: [m].
        beyond: Of the radius: how far outside the sphere triangles may begin that belong to parts; infinite: all do, as
            where only those within a sphere are given, some of which a cut left a little outside.
    """
    corners = points[triangles]
    gaps = np.linalg.norm(closest_on_triangles(center, corners) - center, axis=1)
    reached = np.flatnonzero(gaps <= radius * (1.0 + beyond))
    found = np.zeros(len(triangles), dtype=bool)
    if not len(reached):
        return found
    part = part_of_each(triangles[reached])
    nearest = np.full(part.max() + 1, np.inf)
    np.minimum.at(nearest, part, gaps[reached])
    least = float(nearest.min())
    found[reached[nearest[part] > least + _FARTHEST * (radius - least)]] = True
    return found
