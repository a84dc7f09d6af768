"""Files whose content is verified when they are read: a damaged one is never taken for a good one.

The content is followed by its length, its SHA-256 and a mark. Files are read whole, and only if they are regular files,
so that a named pipe in their place stops nobody.
"""

from __future__ import annotations

import hashlib
import io
import os
import stat
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.support.files import replaced

_MARK = b"calmotion-1\n"
_TAIL = 8 + hashlib.sha256().digest_size + len(_MARK)


class DamagedFileError(ValueError):
    """A file is not what was written: it is cut, changed, or not ours."""


def sealed(content: bytes) -> bytes:
    """Content with what `unsealed` verifies."""
    return content + len(content).to_bytes(8, "little") + hashlib.sha256(content).digest() + _MARK


def unsealed(data: bytes) -> bytes:
    """The content of `sealed`.

    Raises:
        DamagedFileError: The data are not those of `sealed`.
    """
    content, tail = data[:-_TAIL], data[-_TAIL:]
    if len(data) < _TAIL or sealed(content)[-_TAIL:] != tail:
        raise DamagedFileError("the file is damaged")
    return content


def read_verified(path: str | Path) -> bytes:
    """The content of a file that was written as `sealed`.

    Raises:
        FileNotFoundError: There is no file.
        DamagedFileError: The file is damaged, or no regular file.
        OSError: It cannot be read.
    """
    # without waiting: the open of a named pipe would wait for a writer
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise DamagedFileError("it is not a regular file")
        with open(descriptor, "rb", closefd=False) as file:
            return unsealed(file.read())
    finally:
        os.close(descriptor)


def write_arrays(path: str | Path, arrays: Mapping[str, Any], keep_existing: bool = False) -> None:
    """Write arrays to one verified file, see `files.replaced`.

    Raises:
        OSError: The file cannot be written; what was at `path` is still there.
    """
    archive = io.BytesIO()
    np.savez(archive, **arrays)
    with replaced(path, keep_existing) as temporary:
        temporary.write_bytes(sealed(archive.getvalue()))


def read_arrays(path: str | Path) -> dict[str, np.ndarray]:
    """The arrays of a file that `write_arrays` wrote, by name.

    Raises:
        FileNotFoundError: There is no file.
        DamagedFileError: The file is damaged, or no regular file.
        OSError: It cannot be read.
    """
    try:
        with np.load(io.BytesIO(read_verified(path)), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (zipfile.BadZipFile, KeyError, EOFError, TypeError) as error:  # whole, but no archive of arrays
        raise DamagedFileError("the file has no arrays") from error
    except ValueError as error:
        raise error if isinstance(error, DamagedFileError) else DamagedFileError("the file has no arrays") from error
