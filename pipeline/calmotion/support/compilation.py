"""Compiled kernels, cached on disk under a key of all their sources.

numba's own cache looks at one file at a time, so a kernel compiled into its caller would go stale when only the
kernel's file changes, or a constant that it imports. The folder is named by a hash of everything that is compiled in
instead, and lies in the user's cache, so that an installation that cannot be written to caches as well.

Private interfaces of numba make a first run several times as fast (`numba_internals`). With `CALMOTION_PLAIN_NUMBA=1`,
and with a version of numba that is not known, kernels are compiled by `numba.njit` alone: they compute the same.
"""

import contextlib
import hashlib
import os
import re
import stat
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import llvmlite
import numba
import numpy as np
from numba import config, njit
from numba.core import event

from calmotion.errors import ShotError
from calmotion.support.caching.bundled_kernels import digest_of, with_imports
from calmotion.support.caching.cache_folder import KERNELS, cache_folder
from calmotion.support.caching.caches import mark_used, prune
from calmotion.support.files import is_own
from calmotion.support.operating_system import locked

Function = TypeVar("Function", bound=Callable[..., Any])

PACKAGE = Path(__file__).parents[1]
# Flags for the kernels that a kernel calls: numba compiles these anew for every literal True and False they are given.
YES, NO = cast(bool, np.bool_(True)), cast(bool, np.bool_(False))
FUSED = {"contract"}  # a product and a sum in one rounding; nothing that would reorder or drop terms
# Modules of this folder that decide what is compiled.
_COMPILERS = {"by_reference.py", "compilation.py", "numba_internals.py"}
_KERNEL = re.compile(rb"kernel\ndef ")
_KNOWN = ((0, 63), (0, 68))  # first and last version of numba whose private interfaces are those that are used
PLAIN = "CALMOTION_PLAIN_NUMBA"  # in the environment, `1`: none of them


class Compilation(event.Listener):  # type: ignore[misc]
    """What was compiled in this process; told by events that numba documents.

    Attributes:
        compiled: Number of kernels.
        kernel: The one that is being compiled; empty where none is.
        seconds: Processor time of those that are compiled, kernels within kernels counted once [s].
        processes: That compile for one cache now, this one included, and wait for each other's kernels.
    """

    TYPICAL = 220  # kernels of a shot with flexible links: the bartender with empty caches

    def __init__(self) -> None:
        self.compiled, self.kernel, self.seconds = 0, "", 0.0
        self.processes = 1
        self._depth, self._begin = 0, 0.0
        event.register("numba:compile", self)

    def on_start(self, happened: Any) -> None:
        """A kernel is compiled, maybe for one that calls it."""
        if not self._depth:
            self._begin = time.process_time()
        self._depth += 1
        self.kernel = happened.data["dispatcher"].py_func.__name__

    def on_end(self, happened: Any) -> None:
        """A kernel was compiled."""
        self.compiled += 1
        self._depth -= 1
        if not self._depth:
            self.seconds += time.process_time() - self._begin
            self.kernel = ""

    @property
    def time_left_s(self) -> float | None:
        """Time that the rest of a shot's kernels takes [s]; None while that is not known."""
        if self.compiled < self.TYPICAL // 10:
            return None
        spent = self.seconds + (time.process_time() - self._begin if self._depth else 0.0)
        there = self.compiled if self.processes == 1 else kernels_in(cache_place())
        return max(0.0, spent / self.compiled * (self.TYPICAL - there) / self.processes)

    @contextlib.contextmanager
    def claimed(self, name: str, arguments: object) -> Iterator[None]:
        """While a kernel is compiled: wait for another process that compiles it, and has put it in the cache then.

        Args:
            name: Of the kernel, with its module.
            arguments: Their types.
        """
        if self.processes == 1:
            yield
            return
        self.kernel = name.rpartition(".")[2]
        digest = hashlib.sha256(str(arguments).encode()).hexdigest()[:8]
        try:
            with locked(cache_place(), f"{name}.{digest}.claim"):
                yield
        finally:
            self.kernel = self.kernel if self._depth else ""


compiling = Compilation()


def kernels_in(folder: Path) -> int:
    """Number of the compiled kernels in a folder of the cache."""
    return sum(1 for _ in folder.rglob("*.nbc"))


def is_plain() -> bool:
    """Whether kernels are compiled without private interfaces of numba."""
    version = tuple(int(part) for part in re.findall(r"\d+", numba.__version__)[:2])
    return os.environ.get(PLAIN) == "1" or not _KNOWN[0] <= version <= _KNOWN[1]


def cache_place() -> Path:
    """Where kernels are kept: `$NUMBA_CACHE_DIR`, whose files are verified, else the cache of these sources."""
    chosen = None if is_plain() else os.environ.get("NUMBA_CACHE_DIR")
    return Path(chosen) if chosen else kernel_folder()


@cache
def kernel_folder() -> Path:
    """Folder of the compiled kernels of exactly these sources, options and versions; those of old ones go."""
    folder = cache_folder() / KERNELS / kernel_key(PACKAGE)[:16]
    if not folder.is_dir():
        prune(KERNELS)
    mark_used(folder)
    return folder


def kernel_key(package: Path) -> str:
    """Hash of all that ends up in machine code.

    That is the sources of all kernels, of the modules that these import, since constants are compiled in, and of those
    that compile, with their options; the optimisation level; and the versions of numba, llvmlite and Python. numba
    itself tells processors apart.
    """
    kernels = [path for path in package.rglob("*.py") if _KERNEL.search(path.read_bytes())]
    support = package / "support"
    used = {
        path for path in with_imports(kernels, package.parent) if support not in path.parents
    }  # nothing of it is compiled
    sources = sorted({*used, *(path for path in support.glob("*.py") if path.name in _COMPILERS)})
    versions = f"numba {numba.__version__} llvmlite {llvmlite.__version__} python {sys.version_info[:2]}"
    return hashlib.sha256(f"plain {is_plain()} {versions} opt {config.OPT} {digest_of(sources)}".encode()).hexdigest()


def kernel(function: Function) -> Function:
    """Compile a function with numba when it is first called, and keep the result on disk.

    It must not allocate: without reference counting it compiles in a fraction of the time. It runs without the
    interpreter's lock. Arrays that it returns are views without a reference, so that only another `kernel` may call
    one that returns any, neither Python nor an `allocating_kernel`.
    """
    return _compile(function)


def inlined_kernel(function: Function) -> Function:
    """A `kernel` that one other calls: compiled into that one, and by itself only where Python calls it.

    Of a kernel that another calls numba makes machine code twice, by itself and in the other, and three times where
    that is called in turn.
    """
    return _compile(function, inline="always")


def shared_kernel(function: Function) -> Function:
    """A large `kernel` of a module that several others call: compiled once, and called at its address."""
    return _compile(function, one_copy=True)


def allocating_kernel(function: Function) -> Function:
    """`kernel` for a function that makes arrays."""
    return _compile(function, arrays=True)


def _compile(function: Function, *, inline: str = "never", one_copy: bool = False, arrays: bool = False) -> Function:
    if config.DISABLE_JIT:
        raise ShotError(
            "simulations are compiled by numba, which is told not to compile",
            attribute="NUMBA_DISABLE_JIT",
            found=os.environ.get("NUMBA_DISABLE_JIT", "numba.config.DISABLE_JIT is set"),
            remedy="Unset this variable of the environment.",
        )
    # numba picks the folder when a function is decorated; other users of numba keep theirs
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_place())
    try:
        if is_plain():
            return cast(Function, njit(cache=_is_private(cache_place()), fastmath=FUSED, nogil=not arrays)(function))
        from calmotion.support.numba_internals import compiled

        return cast(
            Function, compiled(function, {"fastmath": FUSED, "inline": inline}, one_copy, arrays, compiling.claimed)
        )
    finally:
        config.CACHE_DIR = before


def _is_private(folder: Path) -> bool:
    """Whether no other user can write into a folder, which is made: numba unpickles what lies there unseen."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
    except OSError:
        return False
    # what numba makes in it may be open to others, so they must not get there
    return is_own(status) and not status.st_mode & (stat.S_IXGRP | stat.S_IXOTH)
