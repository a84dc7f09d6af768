"""How long something takes."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np


def median_time(action: Callable[[], object], repeats: int = 5) -> float:
    """Median time of an action [s]; the first call, which may compile or load, does not count."""
    action()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        action()
        times.append(time.perf_counter() - begin)
    return float(np.median(times))
