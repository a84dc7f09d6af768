"""Dead centres: poses in which a closed chain has one more degree of freedom, where a linkage may branch."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array

NEAR = 0.1  # fraction of its median below which a margin is that of a dead centre


def dead_centres(margins: Array) -> list[int]:
    """Instants at which the closed chains pass close to a dead centre: sharp minima of their margin.

    Args:
        margins: Of a `trajectory.Trajectory`, shape [T]; the first instant has none.
    """
    inner = margins[1:]
    if len(inner) < 3 or not np.any(inner > 0.0):
        return []
    low = NEAR * float(np.median(inner))
    return [
        n + 1
        for n in range(1, len(inner) - 1)
        if inner[n] < low and inner[n] < inner[n - 1] and inner[n] <= inner[n + 1]
    ]
