"""How much memory this process has taken, and how much it may still take."""

from __future__ import annotations

import os
import sys
from pathlib import Path

# Files with the limit and the use of memory [bytes] of a control group, of the second and the first version.
_GROUPS = (
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
)
_MEMINFO = "/proc/meminfo"


def peak_memory() -> float:
    """Peak memory of this process [GB]; NaN where the system does not tell."""
    try:
        import resource
    except ImportError:
        return float("nan")
    unit = 1.0 if sys.platform == "darwin" else 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e9


def resident_memory() -> int | None:
    """Memory of this process [bytes]; None where the system does not tell."""
    pages = _read("/proc/self/statm").split()[1:2]
    if not pages:
        return None
    import resource

    return int(pages[0]) * resource.getpagesize()


def available_memory() -> float:
    """Memory that this process can still take without swapping [bytes]: what the machine has free, and what a container
    and the limit of the address space leave; infinite where the system does not tell."""
    return min(_free_memory(), *(_group_memory(limit, use) for limit, use in _GROUPS), _address_space())


def too_large(path: str, factor: float) -> str:
    """Why a file is not read: its content would not fit into the free memory; empty where it does or there is none.

    Args:
        path: The file.
        factor: Memory that its content takes, by the size of the file.
    """
    try:
        size = float(os.path.getsize(path))
    except (OSError, ValueError):
        return ""
    free = available_memory()
    needed = factor * size
    return (
        f"{size / 1e9:.2f} GB, for which {needed / 1e9:.1f} of {free / 1e9:.1f} GB are needed" if needed > free else ""
    )


def _free_memory() -> float:
    for line in _read(_MEMINFO).splitlines():
        if line.startswith("MemAvailable:"):
            return 1024.0 * float(line.split()[1])
    return float("inf")


def _group_memory(limit: str, use: str) -> float:
    allowed, used = _read(limit).strip(), _read(use).strip()
    return max(0.0, float(allowed) - float(used)) if allowed.isdigit() and used.isdigit() else float("inf")


def _address_space() -> float:
    try:
        import resource
    except ImportError:
        return float("inf")
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit == resource.RLIM_INFINITY:
        return float("inf")
    pages = _read("/proc/self/statm").split()[:1]
    return max(0.0, float(limit) - (float(pages[0]) * resource.getpagesize() if pages else 0.0))


def _read(path: str) -> str:
    try:
        return Path(path).read_text()
    except OSError:
        return ""
