"""Independent pieces of work in threads: compiled kernels and products of NumPy run without the interpreter's lock."""

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from functools import cache
from typing import Any, TypeVar

from calmotion.multibody.sensitivity.linearization import processors

Item = TypeVar("Item")
Found = TypeVar("Found")
_OFTEN = 0.1  # between two reports [s]
_WORKER = threading.local()


def in_parallel(
    work: Callable[[Item], Found], items: Sequence[Item], done: Callable[[int], None] | None = None
) -> list[Found]:
    """The results of a function for all items, in their order.

    Work within such work has one thread.

    Args:
        work: Called for each item, in any thread.
        items: To work on.
        done: Called in this thread, several times a second, with the number of items that are done; what it raises
            ends the work.

    Raises:
        Exception: That of the first item whose work fails, after the others have ended.
    """
    if len(items) < 2 or processors() < 2 or getattr(_WORKER, "works", False):
        found = []
        for number, item in enumerate(items):
            if done is not None:
                done(number)
            found.append(work(item))
        return found
    futures = [_pool().submit(work, item) for item in items]
    try:
        running = set(futures)
        while done is not None and running:
            done(len(futures) - len(running))
            _, running = wait(running, _OFTEN, FIRST_COMPLETED)
        return [future.result() for future in futures]
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    finally:
        wait(futures)  # after a failure or an interrupt, too: nobody else may use what they work on


def at_once(*calls: Callable[[], Any]) -> list[Any]:
    """The results of some independent calls, in their order; raises as `in_parallel`."""
    return in_parallel(lambda call: call(), calls)


def _begin() -> None:
    _WORKER.works = True


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(processors(), thread_name_prefix="calmotion", initializer=_begin)


if hasattr(os, "register_at_fork"):  # a forked process has none of the threads, and would wait for them for ever
    os.register_at_fork(after_in_child=_pool.cache_clear)
