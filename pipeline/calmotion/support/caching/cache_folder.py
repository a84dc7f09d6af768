"""The user's caches: which there are, and their folder."""

from __future__ import annotations

import os
from pathlib import Path

KERNELS, MESHES, REDUCTIONS = "kernels", "meshes", "reductions"
# Folder of each cache, its content, and its largest size [bytes].
CACHES = {
    KERNELS: ("compiled kernels", 500 * 10**6),
    MESHES: ("tetrahedral meshes", 10**9),
    REDUCTIONS: ("reduced bodies", 2 * 10**9),
}
# Folders of earlier versions, which nothing reads any more; they go when the cache that replaces them is pruned.
FORMER = {MESHES: "tetrahedra", REDUCTIONS: "reduced"}


def cache_folder() -> Path:
    """The user's cache folder of calmotion: `$CALMOTION_CACHE`, else `calmotion` in the system's cache folder."""
    chosen = os.environ.get("CALMOTION_CACHE")
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA") or Path.home() / ".cache"
    return Path(base) / "calmotion"
