"""Atomic replacement of files: a reader sees the old file or the new one, never half of one."""

import contextlib
import errno
import hashlib
import os
import platform
import re
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from calmotion.support import operating_system

PREFIX = ".calmotion-"  # of the names of temporary files
_ABANDONED = 3600.0  # a temporary file of another machine of that age [s] was left by a process that was killed
_NAME = re.compile(re.escape(PREFIX) + r"([0-9a-f]{8})-(\d+)-")


@contextlib.contextmanager
def replaced(path: str | Path) -> Iterator[Path]:
    """A temporary file that replaces `path` when the block ends without an exception.

    The file is created exclusively, under a random name that starts with `PREFIX`, machine and process and has the
    suffix of `path`, in the folder of `path`, and no symbolic link is followed. What killed processes left there is
    removed. Its content is flushed to the disk before it is renamed. An exception in the block removes it. Missing
    folders above `path` are created. The new file has the permissions of the file that it replaces, or of any new file.

    Args:
        path: The file to replace; a symbolic link to a file is replaced itself.

    Yields:
        The path of the temporary file, which is empty.

    Raises:
        OSError: The file cannot be written, or is no file; what was at `path` is still there.
    """
    target = Path(path)
    _refuse_devices(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    remove_abandoned(target.parent)
    with new_file(target) as temporary:
        yield temporary
        _flush(temporary)
        _permit(temporary, target)
        os.replace(temporary, target)
    with contextlib.suppress(OSError):  # the file is in its place; some file systems cannot flush a folder
        _flush(target.parent)


@contextlib.contextmanager
def new_file(target: Path) -> Iterator[Path]:
    """An empty temporary file in the folder of `target` that only this user can read, removed when the block ends.

    Raises:
        OSError: It cannot be made.
    """
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=_own_prefix(), suffix=target.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def temporary_folder(parent: Path | None = None) -> Iterator[Path]:
    """A folder that goes when the block ends; what killed processes of this user left beside it is removed first.

    Args:
        parent: Where it is made; None: among the temporary files of the system.

    Yields:
        The folder, which only this user can read.

    Raises:
        OSError: It cannot be made.
    """
    parent = parent or system_temporary()
    remove_abandoned(parent)
    with tempfile.TemporaryDirectory(prefix=_own_prefix(), dir=parent, ignore_cleanup_errors=True) as folder:
        yield Path(folder)


def system_temporary() -> Path:
    """The system's folder for temporary files.

    `tempfile` looks for it by writing files without a name of ours, one of which stays where the process is killed.
    """
    if tempfile.tempdir is None:
        # where everybody may write: names are random
        for name in filter(None, (*map(os.environ.get, ("TMPDIR", "TEMP", "TMP")), operating_system.TEMPORARY)):
            if os.path.isdir(name) and os.access(name, os.W_OK | os.X_OK):
                tempfile.tempdir = os.path.abspath(name)
                break
    return Path(tempfile.gettempdir())


def write_text(path: str | Path, text: str) -> None:
    """Write a text as UTF-8 without changing its line ends, see `replaced`.

    Raises:
        OSError: The file cannot be written; what was at `path` is still there.
    """
    with replaced(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="")


def try_writing(path: str | Path) -> None:
    """Make the missing folders above a file, and a temporary file there, which is removed at once.

    Raises:
        OSError: The file could not be written.
    """
    target = Path(path)
    if target.is_dir() or os.fspath(path).endswith(("/", os.sep)):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
    if target.name == "-":
        raise OSError(errno.EINVAL, "This would be a file named -, not the standard output", str(path))
    if len(target.parts) > 1 and target.parts[0].startswith("~") and not os.path.isdir(target.parts[0]):
        reason = f"This would be a folder named {target.parts[0]}, not the home folder; write the whole path"
        raise OSError(errno.EINVAL, reason, str(path))
    _refuse_devices(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=target.parent, prefix=PREFIX):
        pass


def is_special(path: str | os.PathLike[str]) -> bool:
    """Whether there is a named pipe, a socket or a device, for whose content a reader would wait for ever."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def refuse_special(path: str | os.PathLike[str]) -> None:
    """Refuse what is no file, also where a link leads to it: who reads a pipe waits for ever, and a device that is
    replaced is gone for all programs.

    Raises:
        OSError: It is a named pipe, a socket or a device.
    """
    if is_special(path):
        raise OSError(errno.EINVAL, "Not a file but a named pipe, a socket or a device", str(path))


def is_own(status: os.stat_result) -> bool:
    """Whether what has this status is of this user, or of the system, and no other user can write it."""
    owner = operating_system.owner()
    if owner is None:
        return True
    return status.st_uid in (0, owner) and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _refuse_devices(target: Path) -> None:
    """Refuse to replace what is no file, or is the system's: the name of standard output is a link, to a file where the
    output goes to one, and would be gone for all programs.

    Raises:
        OSError: It is a named pipe, a socket or a device, or lies in a folder of the system.
    """
    refuse_special(target)
    folder = os.path.realpath(target.parent)
    devices, *others = operating_system.SYSTEM_FOLDERS
    if folder == devices or any(folder == top or folder.startswith(f"{top}/") for top in others):
        raise OSError(errno.EINVAL, "This is a file of the system, which is never replaced", str(target))


def remove_abandoned(folder: Path) -> None:
    """Remove the temporary files and folders that killed processes of this user left in a folder.

    Those are the files of processes of this machine that do not run any more, and others that are older than an hour.
    """
    for path in folder.glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):  # another process removed it
            if not _is_abandoned(path):
                continue
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink()


def _own_prefix() -> str:
    """What the names of temporary files of this process begin with."""
    return f"{PREFIX}{_machine()}-{os.getpid()}-"


def _is_abandoned(path: Path) -> bool:
    state = path.lstat()
    if operating_system.owner() not in (None, state.st_uid):  # in a folder that several users share
        return False
    name = _NAME.match(path.name)
    if name is not None and name[1] == _machine():
        return not operating_system.runs(int(name[2]))
    return time.time() - state.st_mtime > _ABANDONED


@cache
def _machine() -> str:
    """A short name of this machine, or container with its own process numbers, for folders that several share."""
    try:
        numbers = os.stat("/proc/self/ns/pid").st_ino
    except OSError:  # no Linux
        numbers = 0
    return hashlib.sha256(f"{platform.node()} {numbers}".encode()).hexdigest()[:8]


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _permit(path: Path, target: Path) -> None:
    """Give a file, which mkstemp keeps to its owner, the permissions of the file that it replaces, or of a new one."""
    try:
        old = target.lstat().st_mode
    except FileNotFoundError:
        old = 0
    if stat.S_ISREG(old):
        os.chmod(path, old & 0o777)
        return
    mask = os.umask(0)
    os.umask(mask)
    os.chmod(path, 0o666 & ~mask)
