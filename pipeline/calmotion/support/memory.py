"""How much memory this process has taken."""

from __future__ import annotations

import sys


def peak_memory() -> float:
    """Peak memory of this process [GB]; NaN where the system does not tell."""
    try:
        import resource
    except ImportError:
        return float("nan")
    unit = 1.0 if sys.platform == "darwin" else 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e9
