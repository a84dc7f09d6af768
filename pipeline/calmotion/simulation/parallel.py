"""Independent pieces of work in threads: compiled kernels run without the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from typing import TypeVar

from calmotion.multibody.sensitivity.linearization import processors

Item = TypeVar("Item")
Found = TypeVar("Found")


def in_parallel(work: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
    """The results of a function for all items, in their order.

    Raises:
        Exception: That of the first item whose work fails, after the others have ended.
    """
    if len(items) < 2 or processors() < 2:
        return [work(item) for item in items]
    futures = [_pool().submit(work, item) for item in items]
    try:
        return [future.result() for future in futures]
    finally:
        wait(futures)  # after a failure or an interrupt, too: nobody else may use what they work on


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(processors(), thread_name_prefix="calmotion")
