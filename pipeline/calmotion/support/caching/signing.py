"""The key with which this user's caches are signed, so that files of others are never unpickled, linked or simulated.

It lies in the user's configuration folder and is made when it is first needed. Machines that share a cache folder share
the key by `CALMOTION_CACHE_KEY`.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
import stat
from functools import cache
from pathlib import Path

from calmotion.support.caching.cache_folder import configuration_folder
from calmotion.support.files import locked, new_file, remove_abandoned

VARIABLE = "CALMOTION_CACHE_KEY"
FILE_NAME = "cache_key"
_LENGTH = 32


def signing_key() -> bytes:
    """The key; empty where none can be kept: files are then verified, but not signed."""
    given = os.environ.get(VARIABLE)
    return hashlib.sha256(given.encode()).digest() if given else _kept(configuration_folder())


@cache
def _kept(folder: Path) -> bytes:
    """The key in a folder; made where there is none, or one that others can read."""
    path = folder / FILE_NAME
    with contextlib.suppress(OSError):
        remove_abandoned(folder)
        return _read(path) or _made(path)
    return b""


def _read(path: Path) -> bytes:
    """The key of a file; empty where there is none, or where it is not this user's alone."""
    try:
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    except FileNotFoundError:
        return b""
    with open(descriptor, "rb") as file:
        state = os.fstat(descriptor)
        own = os.name != "posix" or (state.st_uid == os.getuid() and not state.st_mode & 0o077)
        content = file.read(_LENGTH + 1) if own and stat.S_ISREG(state.st_mode) else b""
    return content if len(content) == _LENGTH else b""


def _made(path: Path) -> bytes:
    """A new key in a file; that of another process, where one was faster."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # two processes that replace a damaged key would each sign with its own
    with locked(path.parent), new_file(path) as temporary:  # only this user can read it
        temporary.write_bytes(secrets.token_bytes(_LENGTH))
        try:
            os.link(temporary, path)
        except OSError:  # of a faster process, whose key counts; or damaged, or open to others; or no hard links here
            if not _read(path):
                os.replace(temporary, path)
    return _read(path)
