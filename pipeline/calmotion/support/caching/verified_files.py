"""Files whose content is verified when they are read: a damaged one is never taken for a good one.

The content is followed by its length, its SHA-256, the HMAC-SHA-256 of that and the file's name with a key (RFC 2104)
and a mark. A whole file in the place of another one is so no good one either: machine code of another function would
end the program, and the mesh of another body would change its results unseen. Files are read whole, and only if they
are regular files, so that a named pipe in their place stops nobody.
"""

from __future__ import annotations

import hashlib
import hmac
import io
import os
import stat
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.support.files import replaced

_MARK, _FORMER_MARK = b"calmotion-2\n", b"calmotion-1\n"
LARGEST = 4 * 2**30  # bytes
_TAIL = 8 + 2 * hashlib.sha256().digest_size + len(_MARK)


class DamagedFileError(ValueError):
    """A file is not what was written: it is cut, changed, or not ours."""


class ForeignFileError(DamagedFileError):
    """A file is whole, but was written with another key, under another name or by an earlier version."""


def sealed(content: bytes, key: bytes = b"", name: str = "") -> bytes:
    """Content with what `unsealed` verifies; an empty key protects against damage, not against others.

    Args:
        content: What is kept.
        key: Of the signature.
        name: What the content is, where another one could be taken for it.
    """
    digest = hashlib.sha256(content).digest()
    signature = hmac.digest(key, digest + name.encode(), "sha256")
    return content + len(content).to_bytes(8, "little") + digest + signature + _MARK


def unsealed(data: bytes, key: bytes = b"", name: str = "") -> bytes:
    """The content of `sealed` with the same key and name.

    Raises:
        DamagedFileError: The data are not those of `sealed`.
        ForeignFileError: They are those with another key or name, or of an earlier version.
    """
    if data.endswith(_FORMER_MARK):
        raise ForeignFileError("the file is of an earlier version")
    content, tail, size = data[:-_TAIL], data[-_TAIL:], hashlib.sha256().digest_size
    expected = sealed(content, key, name)[-_TAIL:]
    if len(data) < _TAIL or tail[: 8 + size] != expected[: 8 + size] or not tail.endswith(_MARK):
        raise DamagedFileError("the file is damaged")
    if not hmac.compare_digest(tail, expected):
        raise ForeignFileError("the file was written with another key or under another name")
    return content


def read_verified(path: str | Path, key: bytes = b"", name: str = "") -> bytes:
    """The content of a file that was written as `sealed` with the same key and name.

    Raises:
        FileNotFoundError: There is no file.
        ForeignFileError: It was written with another key or under another name.
        DamagedFileError: The file is damaged, or no regular file.
        OSError: It cannot be read.
    """
    # without waiting: the open of a named pipe would wait for a writer
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise DamagedFileError("it is not a regular file")
        if status.st_size > LARGEST:  # it would fill the memory
            raise DamagedFileError("it is larger than any that is written")
        with open(descriptor, "rb", closefd=False) as file:
            return unsealed(file.read(), key, name)
    finally:
        os.close(descriptor)


def write_arrays(
    path: str | Path, arrays: Mapping[str, Any], keep_existing: bool = False, key: bytes = b"", name: str = ""
) -> None:
    """Write arrays to one verified file, signed with a key, see `sealed` and `files.replaced`.

    Raises:
        OSError: The file cannot be written; what was at `path` is still there.
    """
    archive = io.BytesIO()
    np.savez(archive, **arrays)
    with replaced(path, keep_existing) as temporary:
        temporary.write_bytes(sealed(archive.getvalue(), key, name))


def read_arrays(path: str | Path, key: bytes = b"", name: str = "") -> dict[str, np.ndarray]:
    """The arrays of a file that `write_arrays` wrote with the same key and name, by their names.

    A file with an empty key may be anybody's: its arrays take no more memory than the file.

    Raises:
        FileNotFoundError: There is no file.
        ForeignFileError: It was written with another key or under another name.
        DamagedFileError: The file is damaged, or no regular file.
        OSError: It cannot be read.
    """
    try:
        content = read_verified(path, key, name)
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            members = archive.zip.infolist()
            whole = sum(member.file_size for member in members) <= len(content)
            if not whole or any(member.compress_type != zipfile.ZIP_STORED for member in members):
                raise DamagedFileError("its arrays are larger than the file")
            return {name: archive[name] for name in archive.files}
    except (
        zipfile.BadZipFile,
        KeyError,
        EOFError,
        TypeError,
        MemoryError,
        RuntimeError,
    ) as error:  # no archive of ours
        raise DamagedFileError("the file has no arrays") from error
    except ValueError as error:
        raise error if isinstance(error, DamagedFileError) else DamagedFileError("the file has no arrays") from error
