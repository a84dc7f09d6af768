"""numba's cache of compiled functions, with files that are verified before numba unpickles and links them.

numba believes what lies in its cache: a file that a power cut has emptied or changed ends every later run with an error
inside numba or LLVM, or in wrong machine code. Here such a file is removed with a notice, and its function compiled
again. A file that another user can write is never unpickled, and machine code is never taken for that of another
function.
"""

from __future__ import annotations

import pickle
from itertools import count, filterfalse
from pathlib import Path
from typing import Any

from numba.core.caching import IndexDataCacheFile
from numba.core.serialize import dumps

from calmotion.support.caching.bundled_kernels import FOLDER, BundledKernels, name_of
from calmotion.support.caching.caches import store, stored
from calmotion.support.files import locked
from calmotion.support.kernel_compiler import is_called_by_kernel

_FOR_KERNELS = "without an entrance for Python"


class VerifiedCacheFile(IndexDataCacheFile):  # type: ignore[misc]
    """The index and the data of one function, by the same names as numba's.

    Machine code for kernels lacks the entrance for Python, and so is kept under a key of its own.
    """

    def __init__(self, *args: Any, bundled: BundledKernels | None = None, **kwargs: Any):
        super().__init__(*args, **kwargs)
        self._bundled = bundled

    def load(self, key: Any) -> Any:
        """What was saved for a key, or came with the installation; otherwise None."""
        found = super().load(key)
        if found is None and is_called_by_kernel():
            found = super().load((key, _FOR_KERNELS))
        if found is None and self._bundled is not None:
            found = self._bundled.load(key)
            if found is None and is_called_by_kernel():
                found = self._bundled.load(key, _FOR_KERNELS)
        return found

    def save(self, key: Any, data: Any) -> None:
        """Save data for a key.

        numba reads the index, adds to it, and writes it: of two processes that compile at once one would lose its
        entry, or both would give different data the same name. It also writes the index before the data: where the
        run ends between them, the index would name what an earlier one had called so.
        """
        key = (key, _FOR_KERNELS) if is_called_by_kernel() else key
        with locked(Path(self._index_path).parent):
            names = self._load_index()
            name = names.get(key) or next(filterfalse(set(names.values()).__contains__, map(self._data_name, count(1))))
            if _write(Path(self._data_path(name)), data) and key not in names:
                self._save_index(names | {key: name})

    def _load_index(self) -> dict[Any, str]:
        content = _content(Path(self._index_path))
        if content is None:
            return {}
        version, stamp, overloads = pickle.loads(content)  # nosec B301  # written by this user
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        _write(Path(self._index_path), (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        content = _content(Path(self._data_path(name)))
        if content is None:
            raise FileNotFoundError(name)  # numba then compiles the function
        return pickle.loads(content)  # nosec B301  # written by this user


def verified(dispatcher: Any) -> Any:
    """A function that numba compiles and caches, with verified files."""
    cache, package = dispatcher._cache, dispatcher.py_func.__module__.rpartition(".")[0]
    bundled = FOLDER / Path(cache.cache_path).parent.name  # the key of the sources
    cache._cache_file = VerifiedCacheFile(
        cache_path=cache.cache_path, filename_base=cache._impl.filename_base,
        source_stamp=cache._impl.locator.get_source_stamp(),
        bundled=BundledKernels(bundled / package, cache._impl.filename_base) if bundled.is_dir() else None,
    )  # fmt: skip
    return dispatcher


def _content(path: Path) -> bytes | None:
    return stored(path, name_of(path))


def _write(path: Path, value: Any) -> bool:
    """Write a file; whether it is written."""
    return store(path, dumps(value), name_of(path))
