"""Meshes kept in the user's cache folder, by the hash of what they were made from."""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np
from calmotion.support.cache_folder import cache_folder

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

    The tetrahedraliser makes another mesh each time, so where two processes made one, both go on with that which
    was there first: simulations of the same shot then agree.

    Returns:
        What is kept under the key from now on.
    """
    folder, own = cache_folder() / FOLDER, tuple(arrays.values())
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=folder, suffix=".part")
    except OSError:
        return own
    path = folder / f"{key}.npz"
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]
        try:
            os.link(name, path)
        except FileExistsError:
            other = load(key, tuple(arrays))
            if other is not None:
                return other
            os.replace(name, path)
    except OSError:
        # a file system without links: the last one wins
        with contextlib.suppress(OSError):
            os.replace(name, path)
    finally:
        Path(name).unlink(missing_ok=True)
    return own
