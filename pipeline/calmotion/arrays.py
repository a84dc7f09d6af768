"""Types of NumPy arrays that every room uses."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]
Indices = NDArray[np.integer[Any]]  # integers of any width
