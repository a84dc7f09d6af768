"""The user's caches: files that can be made again, verified when they are read, and limited in size.

Each cache is a folder of the user's cache folder. An entry is what is used and removed as one: a file of arrays, or the
folder of the kernels of one version of the sources. The least recently used entries go first. Only files that no other
user can write are read, since kernels are unpickled and run.
"""

import contextlib
import functools
import hashlib
import logging
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.support.caching.cache_folder import CACHES, cache_folder
from calmotion.support.caching.verified_files import (
    DamagedFileError,
    ForeignFileError,
    packed,
    read_verified,
    sealed,
    unpacked,
)
from calmotion.support.files import PREFIX, new_file, remove_abandoned

LOG = logging.getLogger("calmotion")
_MODE = 0o644  # of files, whatever the umask says: a file that others can write is not read


@dataclass(frozen=True)
class Entry:
    """What is used and removed as one.

    Attributes:
        path: A file or a folder.
        size: In bytes.
        used: When it was used last [ns since the epoch].
    """

    path: Path
    size: int
    used: int


def key_of(*parts: object) -> str:
    """Hash of values that determine what is stored; hexadecimal.

    Args:
        parts: Arrays, numbers, texts, None, and tuples, lists, dicts or dataclasses of them.

    Raises:
        TypeError: A part is of another type.
    """
    digest = hashlib.sha256()
    _feed(digest, parts)
    return digest.hexdigest()


def stored(path: Path, name: str) -> bytes | None:
    """The content of a file of a cache; None where there is none that may be used.

    A damaged file is removed with a notice. One of another user or of an earlier version is made again without a word.

    Args:
        name: With which it was stored.
    """
    _tidy(path.parent)
    try:
        return read_verified(path, name, own=True)
    except ForeignFileError:
        pass
    except DamagedFileError:
        discard(path)
    except OSError:  # there is none, or it cannot be read
        pass
    return None


def store(path: Path, content: bytes, name: str) -> bool:
    """Replace a file of a cache as a whole; whether that was possible.

    It is verified when it is read, and so not flushed to the disk. After a full disk, or in a folder of others, its
    content is made again.

    Args:
        name: What the content is, so that the file is not taken in the place of another one.
    """
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        remove_abandoned(path.parent)
        with new_file(path) as temporary:
            temporary.write_bytes(sealed(content, name))
            temporary.chmod(_MODE)
            os.replace(temporary, path)
        return True
    return False


def stored_arrays(cache: str, key: str) -> dict[str, np.ndarray] | None:
    """The arrays that are stored under a key, by name; None where there are none.

    Args:
        cache: A name in `CACHES`.
        key: Hash of all inputs of the arrays.
    """
    path = _file(cache, key)
    content = stored(path, path.name)
    if content is None:
        return None
    try:
        arrays = unpacked(content)
    except DamagedFileError:
        discard(path)
        return None
    mark_used(path)
    return arrays


def store_arrays(cache: str, key: str, arrays: Mapping[str, Any]) -> None:
    """Store arrays under a key, and remove what exceeds the size of the cache.

    Caches are optional: a folder that cannot be written is ignored.

    Args:
        cache: A name in `CACHES`.
        key: Hash of all inputs of the arrays.
        arrays: By name.
    """
    path = _file(cache, key)
    if store(path, packed(arrays), path.name):
        prune(cache)


def discard(path: Path) -> None:
    """Remove a damaged file or folder of a cache, with a notice."""
    LOG.warning("A damaged file of the cache was removed; its content is made again: %s", path)
    _remove(path)


def mark_used(path: Path) -> None:
    """Make an entry the newest one, which is removed last."""
    with contextlib.suppress(OSError):
        os.utime(path)


def entries(cache: str) -> list[Entry]:
    """The entries of a cache, the most recently used first.

    Args:
        cache: A name in `CACHES`.
    """
    found = []
    with contextlib.suppress(OSError):
        for path in (cache_folder() / cache).iterdir():
            if path.name.startswith(PREFIX):
                continue
            with contextlib.suppress(OSError):  # another process has removed it
                found.append(Entry(path, _size(path), path.lstat().st_mtime_ns))
    return sorted(found, key=lambda entry: entry.used, reverse=True)


def prune(cache: str, limit: int | None = None) -> list[Entry]:
    """Remove the least recently used entries until the rest keeps a size; the newest entry stays.

    Args:
        cache: A name in `CACHES`.
        limit: Size [bytes]; None is the cache's own.

    Returns:
        What was removed.
    """
    limit = CACHES[cache][1] if limit is None else limit
    total, removed = 0, []
    for number, entry in enumerate(entries(cache)):
        total += entry.size
        if number and total > limit and _remove(entry.path):
            removed.append(entry)
    return removed


def clear(cache: str) -> list[Entry]:
    """Remove all entries of a cache; what was removed."""
    return [entry for entry in entries(cache) if _remove(entry.path)]


@functools.cache
def _tidy(folder: Path) -> None:
    """Remove what killed processes left in a folder that this one may only read; once in a process."""
    with contextlib.suppress(OSError):
        remove_abandoned(folder)


def _feed(digest: Any, value: Any) -> None:
    """Add a value to a hash, its type and size first, so that different values have different hashes."""
    if isinstance(value, np.ndarray):
        if value.dtype.hasobject:
            raise TypeError("an array of objects cannot be part of a key")
        digest.update(f"array {value.dtype.str} {value.shape} ".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif is_dataclass(value) and not isinstance(value, type):
        digest.update(f"{type(value).__name__} {len(fields(value))} ".encode())
        for field in fields(value):
            _feed(digest, field.name)
            _feed(digest, getattr(value, field.name))
    elif isinstance(value, (tuple, list)):
        digest.update(f"tuple {len(value)} ".encode())
        for element in value:
            _feed(digest, element)
    elif isinstance(value, dict):
        digest.update(f"dict {len(value)} ".encode())
        for name in sorted(value):
            _feed(digest, name)
            _feed(digest, value[name])
    elif value is None or isinstance(value, (bool, int, float, str, bytes, np.generic)):
        plain = value.item() if isinstance(value, np.generic) else value
        text = repr(plain)
        digest.update(f"{type(plain).__name__} {len(text)} {text} ".encode())
    else:
        raise TypeError(f"a {type(value).__name__} cannot be part of a key")


def _file(cache: str, key: str) -> Path:
    return cache_folder() / cache / f"{key}.npz"


def _size(path: Path) -> int:
    """Size of a file, or of the files in a folder [bytes]."""
    if path.is_symlink() or not path.is_dir():
        return path.lstat().st_size
    return sum(part.lstat().st_size for part in path.rglob("*") if not part.is_dir())


def _remove(path: Path) -> bool:
    """Remove a file or a folder, not what a symbolic link names; whether it is gone."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)
    return not os.path.lexists(path)
