"""Poses in which a closed loop has one more way to move than elsewhere: dead centres, where a linkage may branch."""

from __future__ import annotations

import numpy as np

from calmotion.shot.character import Array

NEAR = 0.1  # part of its usual size below which a loop's margin has all but gone


def dead_centres(margins: Array) -> list[int]:
    """Instants at which the closed loops pass such a pose closely: sharp minima of their margin.

    Args:
        margins: Of a `simulation.Trajectory`, shape [T]; the first instant has none.
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
