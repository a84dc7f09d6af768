"""Writing files whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def write_whole(path: str | Path, text: str) -> None:
    """Write a text so that an interrupted run leaves the old file or the new one; folders above it are made.

    Raises:
        OSError: It cannot be written; nothing is left then.
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".tmp")
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        make_public(temporary)
        os.replace(temporary, target)
    except BaseException:
        os.unlink(temporary)
        raise


def make_public(path: str) -> None:
    """Give a file of mkstemp, which only its owner reads, the permissions of any other new file."""
    mask = os.umask(0)
    os.umask(mask)
    os.chmod(path, 0o666 & ~mask)
