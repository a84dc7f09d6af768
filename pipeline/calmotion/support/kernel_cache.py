"""numba's cache of compiled functions, with files that are verified before they are unpickled and linked.

numba believes what lies in its cache: a file that a power cut has emptied or changed ends every later run with an error
inside numba or LLVM, or in wrong machine code. Here such a file is removed with a notice, and its function compiled
again. A file that another user can write is never unpickled, and machine code is never taken for that of another
function.
"""

import pickle
from collections.abc import Callable
from itertools import count, filterfalse
from pathlib import Path
from typing import Any

import numba

from calmotion.support.caching.bundled_kernels import FOLDER, BundledKernels, name_of
from calmotion.support.caching.caches import store, stored
from calmotion.support.operating_system import locked

_FOR_KERNELS = "without an entrance for Python"


class KernelCacheFile:
    """The index and the data of one function, in place of numba's.

    Machine code for kernels lacks the entrance for Python, and so is kept under a key of its own.

    Args:
        folder: That numba has chosen for the source, in the folder of the key of all sources.
        module: Of the function.
        name: Of its files.
        stamp: Of its source.
        dumps: Pickles what is kept.
        for_kernels: Whether what is kept or wanted now is called by other kernels, not by Python.
        bundles: Folder of the kernels that came with the installation.
    """

    def __init__(
        self, folder: Path, module: str, name: str, stamp: Any, dumps: Callable[[Any], bytes],
        for_kernels: Callable[[], bool], bundles: Path = FOLDER,
    ):  # fmt: skip
        package = module.rpartition(".")[0]
        # by the name of the package, not by its place, so that a wheel can bring them
        self._folder = folder.parent / package if package.split(".")[0] == "calmotion" else folder
        self._name, self._stamp = name, stamp
        self._dumps, self._for_kernels = dumps, for_kernels
        bundled = bundles / folder.parent.name / package
        self._bundled = BundledKernels(bundled, name) if bundled.is_dir() else None

    def load(self, key: Any) -> Any:
        """What was saved for a key, or came with the installation; otherwise None."""
        found = self._own(key)
        if found is None and self._for_kernels():
            found = self._own((key, _FOR_KERNELS))
        if found is None and self._bundled is not None:
            found = self._bundled.load(key)
            if found is None and self._for_kernels():
                found = self._bundled.load(key, _FOR_KERNELS)
        return found

    def save(self, key: Any, data: Any) -> None:
        """Save data for a key.

        numba reads the index, adds to it, and writes it: of two processes that compile at once one would lose its
        entry, or both would give different data the same name. It also writes the index before the data: where the
        run ends between them, the index would name what an earlier one had called so.
        """
        key = (key, _FOR_KERNELS) if self._for_kernels() else key
        with locked(self._folder):
            names = self._index()
            free = filterfalse(set(names.values()).__contains__, (f"{self._name}.{n}.nbc" for n in count(1)))
            name = names.get(key) or next(free)
            if self._write(name, data) and key not in names:
                self._write_index(names | {key: name})

    def flush(self) -> None:
        """Forget all that was saved."""
        self._write_index({})

    def _own(self, key: Any) -> Any:
        name = self._index().get(key)
        return None if name is None else self._read(name)

    def _index(self) -> dict[Any, str]:
        version, stamp, names = self._read(f"{self._name}.nbi") or (None, None, {})
        return names if (version, stamp) == (numba.__version__, self._stamp) else {}

    def _write_index(self, names: dict[Any, str]) -> None:
        self._write(f"{self._name}.nbi", (numba.__version__, self._stamp, names))

    def _read(self, name: str) -> Any:
        path = self._folder / name
        content = stored(path, name_of(path))
        return None if content is None else pickle.loads(content)  # nosec B301  # written by this user

    def _write(self, name: str, value: Any) -> bool:
        """Write a file; whether it is written."""
        path = self._folder / name
        return store(path, self._dumps(value), name_of(path))
