"""Meshes kept in the user's cache folder, by the hash of what they were made from."""

from __future__ import annotations

import contextlib
import hashlib
import zipfile

import numpy as np
from calmotion.support.cache_folder import cache_folder
from calmotion.support.files import remove_abandoned, replaced

FOLDER = "tetrahedra"


def cache_key(points: np.ndarray, triangles: np.ndarray, settings: dict[str, object]) -> str:
    """Hash of a surface and of everything else that decides its mesh."""
    digest = hashlib.sha256()
    for array in (np.ascontiguousarray(points, dtype="<f8"), np.ascontiguousarray(triangles, dtype="<i4")):
        digest.update(str(array.shape).encode())
        digest.update(array.tobytes())
    digest.update(repr(sorted(settings.items())).encode())
    return digest.hexdigest()


def load(key: str, names: tuple[str, ...] = ("points", "tets")) -> tuple[np.ndarray, ...] | None:
    """The arrays kept under a key; None when there are none, or the file is damaged."""
    try:
        with np.load(cache_folder() / FOLDER / f"{key}.npz", allow_pickle=False) as file:
            return tuple(file[name] for name in names)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def store(key: str, **arrays: np.ndarray) -> tuple[np.ndarray, ...]:
    """Keep arrays; a reader sees all of them or nothing. A folder that cannot be written is passed over.

    The tetrahedraliser makes another mesh each time. Where two processes make one, both go on with the one that is
    stored first: simulations of the same shot then agree.

    Returns:
        The arrays that are kept under the key from now on.
    """
    path, names = cache_folder() / FOLDER / f"{key}.npz", tuple(arrays)
    with contextlib.suppress(OSError):
        for keep_existing in (True, False):  # a second time over a damaged file
            with replaced(path, keep_existing) as temporary:
                np.savez(temporary, **arrays)  # type: ignore[arg-type]
            remove_abandoned(path.parent)
            stored = load(key, names)
            if stored is not None:
                return stored
    return tuple(arrays.values())
