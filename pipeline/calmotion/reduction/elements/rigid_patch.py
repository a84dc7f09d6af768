"""Rigid motions of the nodes of an interface patch."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array


def rigid_patch(nodes: Array, center: Array) -> Array:
    """Displacement of nodes for a unit translation and a unit small rotation about `center`, shape [k, 3, 6]."""
    motion = np.zeros((len(nodes), 3, 6))
    motion[:, :, :3] = np.eye(3)
    for axis in range(3):
        motion[:, :, 3 + axis] = np.cross(np.eye(3)[axis], nodes - center)
    return motion
