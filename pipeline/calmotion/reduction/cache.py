"""Cache of reduced bodies in the cache folder of the user, by the hash of all inputs.

A file has no pickled objects: the arrays of a value, and its structure as JSON. It is verified when it is read and
replaced atomically, see `support.caches`. What cannot be read is computed and written again.
"""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from functools import cache
from importlib.metadata import version
from typing import Any, TypeVar

import numpy as np

from calmotion.model.meshes import CutPatch, FEMesh, MeshQuality
from calmotion.model.result import Simplification
from calmotion.reduction.reduced_body import Elasticity, Invariants, Marker, ReducedBody
from calmotion.support.caching.bundled_kernels import source_digest
from calmotion.support.caching.cache_folder import REDUCTIONS
from calmotion.support.caching.caches import key_of, store_arrays, stored_arrays

T = TypeVar("T")

FORMAT = 1  # to increment when the meaning of the content of a file changes

# A file names the types of its values. Only these are constructed, besides arrays, numbers, strings, None and tuples.
_TYPES = (CutPatch, Elasticity, FEMesh, Invariants, Marker, MeshQuality, ReducedBody, Simplification)
TYPES: dict[str, type] = {kind.__name__: kind for kind in _TYPES}


_recomputed: ContextVar[bool] = ContextVar("recomputed", default=False)


@contextmanager
def recomputed() -> Iterator[None]:
    """Context in which values are computed although they are stored: for measurements of time."""
    token = _recomputed.set(True)
    try:
        yield
    finally:
        _recomputed.reset(token)


def cached_reduction(key_parts: object, compute: Callable[[], T]) -> T:
    """The value of `compute()`, from the cache where it is stored.

    Args:
        key_parts: All inputs of the value besides the sources of this package: arrays, numbers, strings, None, and
            tuples, lists, dicts or dataclasses of them.
        compute: Computes the value, of the same kinds, with dataclasses from `TYPES`.

    Returns:
        The value of `compute()`; lists are returned as tuples, arrays bit for bit.

    Raises:
        TypeError: A part of the key or of the value has another type.
    """
    found: T | None = None if _recomputed.get() else known_reduction(key_parts)
    if found is not None:
        return found
    value = compute()
    store_reduction(key_parts, value)
    return value


def store_reduction(key_parts: object, value: object) -> None:
    """Store a value under a key, see `cached_reduction`, in place of the one that is there."""
    key, arrays = cache_key(key_parts), list[Any]()
    structure = json.dumps({"key": key, "value": _encode(value, arrays)}).encode()
    named = {f"a{k}": array for k, array in enumerate(arrays)}
    store_arrays(REDUCTIONS, key, {"structure": np.frombuffer(structure, dtype=np.uint8)} | named)


def known_reduction(key_parts: object) -> Any:
    """What is stored under a key, see `cached_reduction`; None where nothing is."""
    key = cache_key(key_parts)
    stored = stored_arrays(REDUCTIONS, key)
    if stored is None:
        return None
    try:
        return _value_of(stored, key)
    except (ValueError, KeyError, TypeError, AttributeError):  # of another version of the program
        return None


def cache_key(parts: object) -> str:
    """Hash of values, see `key_of`, and of the sources of this package; hexadecimal."""
    return key_of(FORMAT, _sources(), parts)


@cache
def _sources() -> str:
    packages = (f"{package} {version(package)}" for package in ("numpy", "scipy", "scikit-fem"))
    return " ".join([source_digest("reduction"), *packages])


def _value_of(arrays: dict[str, np.ndarray], key: str) -> Any:
    head = json.loads(bytes(arrays["structure"]))
    if head["key"] != key:
        raise ValueError("this file has another key")
    return _decode(head["value"], arrays)


def _encode(value: Any, arrays: list[Any]) -> Any:
    """A value as JSON; its arrays are appended to a list and represented by their index."""
    if isinstance(value, np.ndarray):
        if value.dtype.hasobject:
            raise TypeError("an array of objects cannot be stored")
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if is_dataclass(value) and not isinstance(value, type):
        name = type(value).__name__
        if TYPES.get(name) is not type(value):
            raise TypeError(f"{name} is not in reduction.cache.TYPES")
        return {"type": name, "fields": {f.name: _encode(getattr(value, f.name), arrays) for f in fields(value)}}
    if isinstance(value, (tuple, list)):
        return {"tuple": [_encode(element, arrays) for element in value]}
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, float, str)):
        return {"plain": value}
    raise TypeError(f"a {type(value).__name__} cannot be stored")


def _decode(node: Any, arrays: dict[str, np.ndarray]) -> Any:
    """The value of a node of the JSON structure."""
    if "array" in node:
        return arrays[f"a{node['array']}"]
    if "type" in node:
        kind = TYPES[node["type"]]
        values = {name: _decode(value, arrays) for name, value in node["fields"].items()}
        if set(values) != {field.name for field in fields(kind)}:
            raise ValueError("this file has another version")
        return kind(**values)
    if "tuple" in node:
        return tuple(_decode(part, arrays) for part in node["tuple"])
    return node["plain"]
