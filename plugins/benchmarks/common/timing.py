"""Time that something takes, and where."""

import os
import platform
import time
from collections.abc import Callable

import numpy as np


def median_time(action: Callable[[], object], repeats: int = 5, *, warm: bool = False, enough: float = np.inf) -> float:
    """Median time of an action [s]; the first call, which may compile or load, does not count.

    Args:
        action: What is timed.
        repeats: How often at most.
        warm: Whether it was called before.
        enough: No more calls once they have taken this long together [s].
    """
    if not warm:
        action()
    times: list[float] = []
    while len(times) < repeats and sum(times) < enough:
        begin = time.perf_counter()
        action()
        times.append(time.perf_counter() - begin)
    return float(np.median(times))


def processor_time() -> float:
    """That of this process and of those that it started and that have ended [s]: other work changes it little."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def machine() -> dict[str, object]:
    """The machine of a measurement."""
    return {
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }
