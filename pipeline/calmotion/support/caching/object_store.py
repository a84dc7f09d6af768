"""Meshes and reduced bodies in an object store that workers of several machines share, by `fsspec`.

Each worker keeps its own cache in front of it. An object is a file of the cache as it is, with its signature, so that
who can write to the store can neither forge a mesh nor damage one unseen. Compiled kernels are never there.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import os
import posixpath
import secrets
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError
from calmotion.support.caching.cache_folder import SHARED, SHARED_VARIABLE
from calmotion.support.caching.verified_files import LARGEST, DamagedFileError, ForeignFileError, unsealed
from calmotion.support.files import replaced

_DAMAGED: set[str] = set()  # objects that this process found damaged
LOG = logging.getLogger("calmotion")


def is_address(place: str) -> bool:
    """Whether a place is the address of an object store, and no folder."""
    return "://" in place


def check_store(address: str) -> None:
    """Refuse an address that cannot be used, before any work.

    Raises:
        ShotError: `fsspec`, or what it needs for this kind of store, is not installed, or the store does not answer.
    """
    try:
        import fsspec
    except ImportError as error:
        raise ShotError(
            "fsspec is not installed", path=address, remedy="pip install 'calmotion[store]'"
        ) from error  # fmt: skip
    try:
        filesystem, root = fsspec.core.url_to_fs(address)
        filesystem.exists(root)
    except (ImportError, ValueError, OSError) as error:
        raise ShotError(
            "the shared cache cannot be used", path=address, attribute="--shared-cache", found=error,
            remedy="Correct the address, its credentials, or install what fsspec needs for it (s3fs, gcsfs, adlfs)",
        ) from error  # fmt: skip


def fetch(cache: str, path: Path, key: bytes) -> bool:
    """Fetch the object of a file that is not there into its place; whether it is there now.

    An object that is damaged, signed with another key or name, or too large is left where it is, and not used.

    Args:
        cache: A name in `CACHES`.
        path: The file of the worker's own cache.
        key: Of the signature.
    """
    store = _store(cache)
    if store is None:
        return False
    try:
        name = posixpath.join(store[1], cache, path.name)
        if int(store[0].info(name)["size"]) > LARGEST:
            raise DamagedFileError("it is larger than any that is written")
        data = bytes(store[0].cat_file(name))
        unsealed(data, key, path.name)
        path.parent.mkdir(parents=True, exist_ok=True)
        with replaced(path) as temporary:
            temporary.write_bytes(data)
    except FileNotFoundError:
        return False
    except ForeignFileError:
        _tell("holds files that are signed with another key or name: give all workers the same CALMOTION_CACHE_KEY")
        return False
    except DamagedFileError as error:
        LOG.warning("An object of the shared cache is not used, and made again: %s: %s", path.name, error)
        _DAMAGED.add(name)
        return False
    except Exception as error:  # of any kind of store: a cache never ends a run
        _tell(f"cannot be read: {error}")
        return False
    return True


def publish(cache: str, path: Path) -> None:
    """Put a file of the worker's own cache into the store, where it is not there, or `fetch` found it damaged.

    Args:
        cache: A name in `CACHES`.
        path: The file.
    """
    store = _store(cache)
    if store is None:
        return
    try:
        name = posixpath.join(store[1], cache, path.name)
        if store[0].exists(name) and name not in _DAMAGED:
            return
        # not in place: a store that is a folder shows what is half written
        part = f"{name}.{secrets.token_hex(8)}.part"  # workers in containers have the same process numbers
        store[0].makedirs(posixpath.dirname(name), exist_ok=True)
        try:
            store[0].pipe_file(part, path.read_bytes())
            store[0].mv(part, name)
        except Exception:  # of any kind of store
            with contextlib.suppress(Exception):
                store[0].rm_file(part)
            raise
        _DAMAGED.discard(name)
    except Exception as error:  # as above
        _tell(f"cannot be written: {error}")


def _store(cache: str) -> tuple[Any, str] | None:
    """The file system and the folder of the store that the environment names; None where there is none."""
    address = os.environ.get(SHARED_VARIABLE, "")
    return _opened(address) if cache in SHARED and is_address(address) else None


@functools.lru_cache(4)
def _opened(address: str) -> tuple[Any, str] | None:
    try:
        import fsspec

        filesystem, root = fsspec.core.url_to_fs(address)
    except (ImportError, ValueError, OSError) as error:
        _tell(f"cannot be used: {error}")
        return None
    return filesystem, str(root)


@functools.cache
def _tell(problem: str) -> None:
    """A warning, once in a process."""
    LOG.warning("The shared cache %s %s", os.environ.get(SHARED_VARIABLE, ""), problem)
