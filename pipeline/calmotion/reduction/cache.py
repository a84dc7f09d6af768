"""Reduced bodies kept in the user's cache folder, by the hash of everything that they follow from.

A file is an `.npz` without pickled objects: the arrays of a value, and its structure as JSON. It is replaced
atomically: a reader sees all of it or nothing, and two writers do not mix. What cannot be read, for whatever reason,
is computed and written again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from calmotion.reduction.reduced_body import Elasticity, Invariants, Marker, ReducedBody
from calmotion.shot.result import Simplification
from calmotion.support.cache_folder import cache_folder
from calmotion.support.files import PREFIX, remove_abandoned, replaced

T = TypeVar("T")

FOLDER = "reduced"
FORMAT = 1  # to be raised when files of the same content are to be read in another way
LIMIT = 2 * 1024**3  # bytes that are kept

# What a file may hold besides arrays, numbers, strings, None and tuples of them; a file names its types, and only
# these are ever made from one.
TYPES: dict[str, type] = {item.__name__: item for item in (Elasticity, Invariants, Simplification, Marker, ReducedBody)}


def cached_reduction(key_parts: object, compute: Callable[[], T]) -> T:
    """The value of `compute()`, from the cache when it is there.

    Args:
        key_parts: Everything that the value follows from besides the sources of this package: arrays, numbers,
            strings, None, and tuples, lists, dicts or dataclasses of them.
        compute: Makes the value, of the same sort, its dataclasses from `TYPES`.

    Returns:
        What `compute()` returns; lists come back as tuples, arrays to the last bit.

    Raises:
        TypeError: A part of the key or of the value is of another sort.
    """
    key = cache_key(key_parts)
    path = cache_folder() / FOLDER / f"{key}.npz"
    try:
        value = _load(path, key)
    except Exception:
        # a torn file can fail in any way: in the archive, the arrays, the structure, or where a type has changed
        pass
    else:
        _mark_used(path)
        return value
    value = compute()
    _store(path, key, value)
    return value


def cache_key(parts: object) -> str:
    """Hash of values, and of the sources that make reduced bodies from them; hexadecimal."""
    digest = hashlib.sha256()
    digest.update(f"{FORMAT} {_sources()}".encode())
    _feed(digest, parts)
    return digest.hexdigest()


@cache
def _sources() -> str:
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    for package in ("numpy", "scipy", "scikit-fem"):
        digest.update(version(package).encode())
    return digest.hexdigest()


def _feed(digest: Any, value: Any) -> None:
    """Add a value to a hash, its type and size first, so that different values never look alike."""
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
        for item in value:
            _feed(digest, item)
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


def _load(path: Path, key: str) -> Any:
    with open(path, "rb") as file, np.load(file, allow_pickle=False) as archive:
        head = json.loads(bytes(archive["structure"]))
        if head["key"] != key:
            raise ValueError("this file was made for something else")
        return _decode(head["value"], archive)


def _store(path: Path, key: str, value: Any) -> None:
    """Keep a value. A folder that cannot be written to is passed over: the cache is a convenience."""
    arrays: list[Any] = []
    structure = json.dumps({"key": key, "value": _encode(value, arrays)}).encode()
    named = {f"a{k}": array for k, array in enumerate(arrays)}
    with contextlib.suppress(OSError):
        with replaced(path) as temporary:
            np.savez(temporary, structure=np.frombuffer(structure, dtype=np.uint8), **named)
        _prune(path.parent, LIMIT)


def _encode(value: Any, arrays: list[Any]) -> Any:
    """A value as JSON; its arrays are appended to a list and stand in it by their number."""
    if isinstance(value, np.ndarray):
        if value.dtype.hasobject:
            raise TypeError("an array of objects cannot be kept")
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if is_dataclass(value) and not isinstance(value, type):
        name = type(value).__name__
        if TYPES.get(name) is not type(value):
            raise TypeError(f"{name} is not in reduction_cache.TYPES")
        return {"type": name, "fields": {f.name: _encode(getattr(value, f.name), arrays) for f in fields(value)}}
    if isinstance(value, (tuple, list)):
        return {"tuple": [_encode(item, arrays) for item in value]}
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, float, str)):
        return {"plain": value}
    raise TypeError(f"a {type(value).__name__} cannot be kept")


def _decode(item: Any, archive: Any) -> Any:
    if "array" in item:
        return archive[f"a{item['array']}"]
    if "type" in item:
        made = TYPES[item["type"]]
        values = {name: _decode(value, archive) for name, value in item["fields"].items()}
        if set(values) != {field.name for field in fields(made)}:
            raise ValueError("this file is of another version")
        return made(**values)
    if "tuple" in item:
        return tuple(_decode(part, archive) for part in item["tuple"])
    return item["plain"]


def _mark_used(path: Path) -> None:
    """Make a file the last to be removed."""
    try:
        os.utime(path)
    except OSError:
        pass


def _prune(folder: Path, limit: int) -> None:
    """Remove the files that were not used for longest until the rest is within the limit [bytes]; the newest stays."""
    remove_abandoned(folder)
    files = []
    for path in folder.iterdir():
        try:
            state = path.stat()
        except OSError:
            continue  # removed by another process
        if path.suffix == ".npz" and not path.name.startswith(PREFIX):
            files.append((state.st_mtime_ns, state.st_size, path))
    files.sort(key=lambda entry: entry[0], reverse=True)
    total = 0
    for k, (_, size, path) in enumerate(files):
        total += size
        if k and total > limit:
            path.unlink(missing_ok=True)
