"""Types of NumPy arrays that every room uses, and the size of a cloud of points."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]
Indices = NDArray[np.integer[Any]]  # integers of any width


def box_diagonal(points: Array) -> float:
    """Diagonal of the box around points, shape [..., 3]."""
    return float(np.linalg.norm(np.ptp(points.reshape(-1, 3), axis=0)))
