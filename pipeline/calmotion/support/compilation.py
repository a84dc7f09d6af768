"""Compiled kernels, cached on disk under a key of all their sources.

numba's own cache looks at one file at a time, so a kernel compiled into its caller would go stale when only the
kernel's file changes, or a constant that it imports. The folder is named by a hash of everything that is compiled in
instead, and lies in the user's cache, so that an installation that cannot be written to caches as well.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import llvmlite
import numba
import numpy as np
from numba import config, njit

from calmotion.errors import ShotError
from calmotion.support import references  # noqa: F401
from calmotion.support.caching.cache_folder import KERNELS, cache_folder
from calmotion.support.caching.caches import mark_used, prune
from calmotion.support.kernel_cache import verified
from calmotion.support.kernel_compiler import KernelCompiler, with_entrance_for_python
from calmotion.support.shared_code import shared, with_addresses
from calmotion.support.sources import digest_of, with_imports

Function = TypeVar("Function", bound=Callable[..., Any])

PACKAGE = Path(__file__).parents[1]
# Flags for the kernels that a kernel calls: numba compiles these anew for every literal True and False they are given.
YES, NO = cast(bool, np.bool_(True)), cast(bool, np.bool_(False))
FUSED = {"contract"}  # a product and a sum in one rounding; nothing that would reorder or drop terms
# Modules of this folder that decide what is compiled.
_COMPILERS = {"by_reference.py", "compilation.py", "kernel_compiler.py", "references.py", "shared_code.py"}
_KERNEL = re.compile(rb"kernel\ndef ")
_WITHOUT_ARRAYS: dict[str, Any] = {"_nrt": False, "no_cfunc_wrapper": True, "nogil": True}  # of its own making


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

    Args:
        package: The folder of the package.
    """
    kernels = [path for path in package.rglob("*.py") if _KERNEL.search(path.read_bytes())]
    support = package / "support"
    used = {
        path for path in with_imports(kernels, package.parent) if support not in path.parents
    }  # nothing of it is compiled
    sources = sorted({*used, *(path for path in support.glob("*.py") if path.name in _COMPILERS)})
    level = f"numba {numba.__version__} llvmlite {llvmlite.__version__} python {sys.version_info[:2]} opt {config.OPT}"
    return hashlib.sha256(f"{level} {digest_of(sources)}".encode()).hexdigest()


def kernel(function: Function) -> Function:
    """Compile a function with numba when it is first called, and keep the result on disk.

    It must not allocate: without reference counting it compiles in a fraction of the time. It runs without the
    interpreter's lock. Arrays that it returns are views without a reference, so that only another `kernel` may call
    one that returns any, neither Python nor an `allocating_kernel`.
    """
    return _compile(function, **_WITHOUT_ARRAYS)


def inlined_kernel(function: Function) -> Function:
    """A `kernel` that one other calls: compiled into that one, and by itself only where Python calls it.

    Of a kernel that another calls numba makes machine code twice, by itself and in the other, and three times where
    that is called in turn.
    """
    return _compile(function, **_WITHOUT_ARRAYS, inline="always")


def shared_kernel(function: Function) -> Function:
    """A large `kernel` of a module that several others call: compiled once, and called at its address."""
    return cast(Function, shared(_compile(function, **_WITHOUT_ARRAYS)))


def allocating_kernel(function: Function) -> Function:
    """`kernel` for a function that makes arrays."""
    return _compile(function)


def _compile(function: Function, **options: Any) -> Function:
    if config.DISABLE_JIT:
        raise ShotError(
            "simulations are compiled by numba, which is told not to compile",
            attribute="NUMBA_DISABLE_JIT",
            found=os.environ.get("NUMBA_DISABLE_JIT", "numba.config.DISABLE_JIT is set"),
            remedy="Unset this variable of the environment.",
        )
    # numba picks the folder when a function is decorated; other users of numba keep theirs
    before = config.CACHE_DIR
    if not os.environ.get("NUMBA_CACHE_DIR"):
        config.CACHE_DIR = str(kernel_folder())
    try:
        dispatcher = njit(cache=True, fastmath=FUSED, pipeline_class=KernelCompiler, **options)(function)
    finally:
        config.CACHE_DIR = before
    return cast(Function, with_addresses(with_entrance_for_python(verified(dispatcher))))
