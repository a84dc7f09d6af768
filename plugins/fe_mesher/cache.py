"""Cache of meshes in the cache folder of the user, by the hash of all inputs."""

from __future__ import annotations

import hashlib

import numpy as np
from calmotion.support.caching.cache_folder import MESHES
from calmotion.support.caching.caches import store_arrays, stored_arrays


def cache_key(points: np.ndarray, triangles: np.ndarray, settings: dict[str, object]) -> str:
    """Hash of a surface and of all settings that affect its mesh."""
    digest = hashlib.sha256()
    for array in (np.ascontiguousarray(points, dtype="<f8"), np.ascontiguousarray(triangles, dtype="<i4")):
        digest.update(str(array.shape).encode())
        digest.update(array.tobytes())
    digest.update(repr(sorted(settings.items())).encode())
    return digest.hexdigest()


def load(key: str, names: tuple[str, ...] = ("points", "tets")) -> tuple[np.ndarray, ...] | None:
    """The arrays stored under a key; None where there are none, or the file is damaged."""
    stored = stored_arrays(MESHES, key)
    return None if stored is None or set(names) - set(stored) else tuple(stored[name] for name in names)


def store(key: str, arrays: dict[str, np.ndarray]) -> None:
    """Store arrays; a reader gets all of them or none. A folder that cannot be written is ignored.

    Args:
        key: Of `cache_key`.
        arrays: By name.
    """
    store_arrays(MESHES, key, arrays)
