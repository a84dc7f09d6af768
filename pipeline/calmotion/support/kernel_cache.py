"""numba's cache of compiled functions, with files that are verified before numba unpickles and links them.

numba believes what lies in its cache: a file that a power cut has emptied or changed ends every later run with an error
inside numba or LLVM, or in wrong machine code. Here such a file is removed with a notice, and its function compiled
again.
"""

from __future__ import annotations

import contextlib
import pickle
from pathlib import Path
from typing import Any

from numba.core.caching import IndexDataCacheFile
from numba.core.serialize import dumps

from calmotion.support.caching.caches import discard
from calmotion.support.caching.verified_files import DamagedFileError, read_verified, sealed
from calmotion.support.files import replaced


class VerifiedCacheFile(IndexDataCacheFile):  # type: ignore[misc]
    """The index and the data of one function, by the same names as numba's."""

    def _load_index(self) -> dict[Any, str]:
        content = _content(Path(self._index_path))
        if content is None:
            return {}
        version, stamp, overloads = pickle.loads(content)
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        _write(Path(self._index_path), (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        content = _content(Path(self._data_path(name)))
        if content is None:
            raise FileNotFoundError(name)  # numba then compiles the function
        return pickle.loads(content)

    def _save_data(self, name: str, data: Any) -> None:
        _write(Path(self._data_path(name)), data)


def verified(dispatcher: Any) -> Any:
    """A function that numba compiles and caches, with verified files."""
    cache = dispatcher._cache
    cache._cache_file = VerifiedCacheFile(
        cache_path=cache.cache_path, filename_base=cache._impl.filename_base,
        source_stamp=cache._impl.locator.get_source_stamp(),
    )  # fmt: skip
    return dispatcher


def _content(path: Path) -> bytes | None:
    try:
        return read_verified(path)
    except DamagedFileError:
        discard(path)
    except FileNotFoundError:
        pass
    return None


def _write(path: Path, value: Any) -> None:
    """Write a file; a full disk or a folder that cannot be written only means that it is compiled again."""
    with contextlib.suppress(OSError), replaced(path) as temporary:
        temporary.write_bytes(sealed(dumps(value)))
