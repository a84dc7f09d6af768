"""How much memory this process has taken, and how much it may still take."""

import os
from pathlib import Path

from calmotion.errors import ShotError
from calmotion.support import operating_system
from calmotion.support.operating_system import address_limit, free_memory

# Files with the limit and the use of memory [bytes] of a control group, of the second and the first version.
_GROUPS = (
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
)
# What native libraries may ask for inside a stage [bytes]: buffers of OpenBLAS, which asks for ever where it gets none,
# machine code, and stacks of threads.
RESERVE = 128e6


def peak_memory() -> float:
    """Peak memory of this process [GB]; NaN where the system does not tell."""
    return operating_system.peak_memory() / 1e9


def available_memory() -> float:
    """Memory that this process can still take without swapping [bytes]: what the machine has free, and what a container
    and the limit of the address space leave; infinite where the system does not tell."""
    return min(free_memory(), *(_group_memory(limit, use) for limit, use in _GROUPS), _address_space())


def too_large(path: str, factor: float) -> str:
    """Why a file is not read: its content would not fit into the free memory; empty where it does or there is none.

    Args:
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


def _group_memory(limit: str, use: str) -> float:
    allowed, used = _read(limit).strip(), _read(use).strip()
    return max(0.0, float(allowed) - float(used)) if allowed.isdigit() and used.isdigit() else float("inf")


def require_address_space(wanted: float, what: str) -> None:
    """Refuse what would not fit into the limit of the address space: native code does not survive that.

    Args:
        wanted: Address space that it takes [bytes].
        what: It, as the subject of a sentence in the singular.

    Raises:
        ShotError: Less is left.
    """
    left = _address_space()
    if left < wanted:
        raise ShotError(
            f"there is not enough memory: {what} takes {wanted / 1e9:.2f} GB of address space",
            found=f"{left / 1e9:.2f} GB left of a limit of {address_limit() / 1e9:.2f} GB",
            remedy="Raise the limit (ulimit -v), or lift it: ulimit -v unlimited",
        )


def was_short() -> bool:
    """Whether this process has come near the limit of its address space: what failed since may have failed by that."""
    limit = address_limit()
    return limit < float("inf") and limit - _status("VmPeak") < RESERVE


def _address_space() -> float:
    limit = address_limit()
    if limit == float("inf"):
        return limit
    return max(0.0, limit - _status("VmSize"))


def _status(name: str) -> float:
    """A size of this process [bytes]; 0 where the system does not tell."""
    for line in _read("/proc/self/status").splitlines():
        if line.startswith(f"{name}:"):
            return 1024.0 * float(line.split()[1])
    return 0.0


def _read(path: str) -> str:
    try:
        return Path(path).read_text(encoding="utf-8")
    except OSError:
        return ""
