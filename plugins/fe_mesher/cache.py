"""Cache of meshes in the cache folder of the user, by the hash of all inputs."""

from __future__ import annotations

import hashlib
from collections.abc import Callable

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


def store(
    key: str, arrays: dict[str, np.ndarray], usable: Callable[[tuple[np.ndarray, ...]], bool] = lambda stored: True
) -> tuple[np.ndarray, ...]:
    """Store arrays; a reader gets all of them or none. A folder that cannot be written is ignored.

    Where two processes make a mesh, both continue with the one that is stored first: where no fixed random numbers can
    be set, the tetrahedraliser makes a different one each time.

    Args:
        key: Of `cache_key`.
        arrays: By name.
        usable: Whether stored arrays, in the same order, may be kept; a file with other ones is replaced.

    Returns:
        The arrays that are stored under the key.
    """
    for keep_existing in (True, False):  # the second time a damaged or unusable file is replaced
        store_arrays(MESHES, key, arrays, keep_existing)
        stored = load(key, tuple(arrays))
        if stored is not None and usable(stored):
            return stored
    return tuple(arrays.values())
