"""One thread for the dense products of a factorisation.

OpenBLAS keeps its threads spinning between calls. Where a factorisation calls it thousands of times, or another
process wants the cores, they wait for each other: on two cores that are also used by others a product of 0.4 ms took
8 ms. One thread is never much slower here and often ten times faster.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any


@cache
def _controller() -> Any:
    """Looking for the loaded libraries takes milliseconds: once."""
    import scipy.linalg  # noqa: F401  SciPy may bring a BLAS of its own
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Within it NumPy's and SciPy's dense products use one thread."""
    with _controller().limit(limits=1, user_api="blas"):
        yield
