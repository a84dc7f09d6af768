"""A round bar: its surface, and few tetrahedra in it."""

import numpy as np

RADIUS, LENGTH, SIDES = 0.02, 0.1, 96


def bar_surface():
    """A round bar along x, of many sides: points and triangles."""
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = RADIUS * np.stack([np.zeros(SIDES), np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([ring, ring + [LENGTH, 0, 0], [[0, 0, 0], [LENGTH, 0, 0]]])
    k, n = np.arange(SIDES), (np.arange(SIDES) + 1) % SIDES
    ends = [
        np.stack([np.full(SIDES, 2 * SIDES), n, k], 1),
        np.stack([np.full(SIDES, 2 * SIDES + 1), k + SIDES, n + SIDES], 1),
    ]
    sides = [np.stack([k, n, n + SIDES], 1), np.stack([k, n + SIDES, k + SIDES], 1)]
    return points, np.concatenate([*ends, *sides])


def coarse_bar(helpers):
    """Few tetrahedra in it, with their corners on it."""
    points, tets = helpers.box((6, 3, 3), (LENGTH, 2.0, 2.0))
    points = np.asarray(points) - [0.0, 1.0, 1.0]
    square = np.abs(points[:, 1:]).max(axis=1)
    round_ = np.maximum(np.linalg.norm(points[:, 1:], axis=1), 1e-12)
    points[:, 1:] *= (RADIUS * square / round_)[:, None]
    return points, tets
