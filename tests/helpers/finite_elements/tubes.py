"""A skin for the tests."""

import numpy as np


def tube(cells=8, length=2.0, width=0.2):
    """A closed box along x in slices, its quads cut in two, and how far along each point is."""
    xs = np.linspace(0.0, length, cells + 1)
    ring = 0.5 * width * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    points = np.array([[x, y, z] for x in xs for y, z in ring])
    sides = [(i, k, (k + 1) % 4) for i in range(cells) for k in range(4)]
    quads = [(4 * i + k, 4 * (i + 1) + k, 4 * (i + 1) + n, 4 * i + n) for i, k, n in sides]
    quads += [(0, 1, 2, 3), (4 * cells + 3, 4 * cells + 2, 4 * cells + 1, 4 * cells)]
    triangles = [t for a, b, c, d in quads for t in ((a, c, b), (a, d, c))]
    return points, np.array(triangles, np.int32)
