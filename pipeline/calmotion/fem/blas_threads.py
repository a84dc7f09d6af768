"""One thread for the dense products of a factorisation.

OpenBLAS keeps its threads spinning between calls. Where a factorisation calls it thousands of times, or another
process wants the cores, they wait for each other: on two cores that are also used by others a product of 0.4 ms took
8 ms. One thread is never much slower here and often ten times faster.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np

_PREFIXES = ("scipy_openblas", "openblas")
_SUFFIXES = ("", "64_", "_64", "64")


@cache
def _switches() -> tuple[tuple[Callable[[], int], Callable[[int], None]], ...]:
    """Getter and setter of the number of threads of each OpenBLAS that NumPy and SciPy bring along."""
    import scipy

    found = []
    for name in (np.__file__, scipy.__file__):
        folder = Path(name).parent
        for libraries in (folder.parent / f"{folder.name}.libs", folder / ".dylibs"):
            for path in sorted(libraries.glob("*openblas*")):
                try:
                    library = ctypes.CDLL(str(path))  # the one that is loaded already
                except OSError:
                    continue
                for symbol in (f"{p}_{{}}_num_threads{s}" for p in _PREFIXES for s in _SUFFIXES):
                    getter, setter = (getattr(library, symbol.format(verb), None) for verb in ("get", "set"))
                    if getter is not None and setter is not None:
                        setter.argtypes, setter.restype = [ctypes.c_int], None
                        found.append((getter, setter))
                        break
    return tuple(found)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Within it NumPy's and SciPy's dense products use one thread; another BLAS than OpenBLAS is left as it is."""
    before = [(setter, getter()) for getter, setter in _switches()]
    for setter, _ in before:
        setter(1)
    try:
        yield
    finally:
        for setter, threads in before:
            setter(threads)
