"""Meshes kept in the user's cache folder, by the hash of what they were made from."""

from __future__ import annotations

import hashlib
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np
from calmotion.cache import cache_folder

FOLDER = "tetrahedra"


def cache_key(points: np.ndarray, triangles: np.ndarray, settings: dict[str, object]) -> str:
    """Hash of a surface and of everything else that decides its mesh."""
    digest = hashlib.sha256()
    for array in (np.ascontiguousarray(points, dtype="<f8"), np.ascontiguousarray(triangles, dtype="<i4")):
        digest.update(str(array.shape).encode())
        digest.update(array.tobytes())
    digest.update(repr(sorted(settings.items())).encode())
    return digest.hexdigest()


def load(key: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Points and tetrahedra kept under a key; None when there are none, or the file is damaged."""
    try:
        with np.load(cache_folder() / FOLDER / f"{key}.npz", allow_pickle=False) as file:
            return file["points"], file["tets"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def store(key: str, points: np.ndarray, tets: np.ndarray) -> None:
    """Keep a mesh; a reader sees all of it or nothing. A folder that cannot be written is passed over."""
    folder = cache_folder() / FOLDER
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=folder, suffix=".part")
    except OSError:
        return
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, points=points, tets=tets)
        os.replace(name, folder / f"{key}.npz")
    except OSError:
        pass
    finally:
        Path(name).unlink(missing_ok=True)
