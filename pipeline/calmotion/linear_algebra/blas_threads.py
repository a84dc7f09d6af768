"""Dense products of a factorisation in one thread.

The threads of OpenBLAS spin between calls. A factorisation calls it thousands of times, and other processes may use the
cores: on two cores shared with other processes a product of 0.4 ms took 8 ms. One thread is at most slightly slower
here and often ten times faster.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any


@cache
def _controller() -> Any:
    """The controller of the loaded libraries; the search for them takes milliseconds."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Context in which the dense products of NumPy and SciPy use one thread."""
    with _controller().limit(limits=1, user_api="blas"):
        yield
