"""Files whose content is verified when they are read: a damaged one is never taken for a good one.

The content is followed by the SHA-256 of the file's name and of the content, and a mark. A whole file in the place of
another one is so no good one either: machine code of another function would end the program, and the mesh of another
body would change its results unseen. Files are read whole, and only if they are regular files, so that a named pipe in
their place stops nobody. What is unpickled or run must also be the user's own, see `read_verified`.
"""

import hashlib
import io
import os
import stat
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.support.files import is_own, replaced

_MARK, _FORMER_MARKS = b"calmotion-3\n", (b"calmotion-1\n", b"calmotion-2\n")
LARGEST = 4 * 2**30  # bytes
_TAIL = hashlib.sha256().digest_size + len(_MARK)


class DamagedFileError(ValueError):
    """A file is not what was written: it is cut, changed, or not ours."""


class ForeignFileError(DamagedFileError):
    """A file is of another user, can be written by others, or was written by an earlier version."""


def sealed(content: bytes, name: str = "") -> bytes:
    """Content with what `unsealed` verifies.

    Args:
        content: What is kept.
        name: What the content is, where another one could be taken for it.
    """
    return content + _digest(content, name) + _MARK


def unsealed(data: bytes, name: str = "") -> bytes:
    """The content of `sealed` with the same name.

    Raises:
        DamagedFileError: The data are not those of `sealed`, or those with another name.
        ForeignFileError: They are of an earlier version.
    """
    if data.endswith(_FORMER_MARKS):
        raise ForeignFileError("the file is of an earlier version")
    content = data[:-_TAIL]
    if data[-_TAIL:] != _digest(content, name) + _MARK:
        raise DamagedFileError("the file is damaged")
    return content


def read_verified(path: str | Path, name: str = "", own: bool = False) -> bytes:
    """The content of a file that was written as `sealed` with the same name.

    Args:
        own: Refuse a file that another user can write, see `files.is_own`.

    Raises:
        FileNotFoundError: There is no file.
        ForeignFileError: Another user can write it, or an earlier version has written it.
        DamagedFileError: The file is damaged, or no regular file.
        OSError: It cannot be read.
    """
    # without waiting: the open of a named pipe would wait for a writer
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        status = os.fstat(descriptor)  # of what is read, whatever is moved to its name meanwhile
        if not stat.S_ISREG(status.st_mode):
            raise DamagedFileError("it is not a regular file")
        if own and not is_own(status):
            raise ForeignFileError("another user can write the file")
        if status.st_size > LARGEST:  # it would fill the memory
            raise DamagedFileError("it is larger than any that is written")
        with open(descriptor, "rb", closefd=False) as file:
            return unsealed(file.read(), name)
    finally:
        os.close(descriptor)


def write_arrays(path: str | Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays to one verified file, see `files.replaced`.

    Raises:
        OSError: The file cannot be written; what was at `path` is still there.
    """
    with replaced(path) as temporary:
        temporary.write_bytes(sealed(packed(arrays)))


def read_arrays(path: str | Path) -> dict[str, np.ndarray]:
    """The arrays of a file that `write_arrays` wrote, by their names.

    The file may be anybody's: its arrays take no more memory than the file, and nothing is unpickled.

    Raises:
        FileNotFoundError: There is no file.
        DamagedFileError: The file is damaged, or no regular file.
        OSError: It cannot be read.
    """
    return unpacked(read_verified(path))


def packed(arrays: Mapping[str, Any]) -> bytes:
    """Arrays as an archive of NumPy."""
    archive = io.BytesIO()
    np.savez(archive, **arrays)
    return archive.getvalue()


def unpacked(content: bytes) -> dict[str, np.ndarray]:
    """The arrays of `packed`, by their names.

    Raises:
        DamagedFileError: There are none, or they are objects, or larger than the content.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            members = archive.zip.infolist()
            whole = sum(member.file_size for member in members) <= len(content)
            if not whole or any(member.compress_type != zipfile.ZIP_STORED for member in members):
                raise DamagedFileError("its arrays are larger than the file")
            return {name: archive[name] for name in archive.files}
    except DamagedFileError:
        raise
    # no archive of ours
    except (zipfile.BadZipFile, KeyError, EOFError, TypeError, MemoryError, RuntimeError, ValueError) as error:
        raise DamagedFileError("the file has no arrays") from error


def _digest(content: bytes, name: str) -> bytes:
    digest = hashlib.sha256(name.encode() + b"\0")
    digest.update(content)
    return digest.digest()
