"""Calls of one function as independent jobs, wherever a batch can run: what is lost with its worker is tried again.

A call that the function refuses, or that fails in it, would fail elsewhere too and is not tried again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import closing
from typing import Any

from calmotion.errors import ShotError
from calmotion.support import interrupts
from calmotion.support.processes.workers import Fault
from calmotion.workflow.batch.backends import Backend

MOST_ATTEMPTS = 3
_TICK = 0.5  # [s]


def results_on(
    backend: Backend, function: Callable[..., Any], work: Sequence[tuple[Any, ...]]
) -> Iterator[tuple[int, Any]]:
    """The results of a function, in the order in which they are ready, each with the index of its work.

    Args:
        backend: Where they run; it is closed at the end, and with it what still runs.
        function: Of a module that workers can import.
        work: Arguments of each call; they and the results must be picklable.

    Yields:
        A `ShotError` instead of a result where the function raised one, a `Fault` where it raised another exception, or
        its workers died `MOST_ATTEMPTS` times.
    """
    with closing(backend):
        waiting = deque((index, 1) for index in range(len(work)))
        running: dict[Future[Any], tuple[int, int]] = {}
        while waiting or running:
            while waiting and (backend.limit is None or len(running) < backend.limit):
                index, number = waiting.popleft()
                running[backend.call(_called, function, work[index])] = index, number
            ended = wait(running, timeout=_TICK, return_when=FIRST_COMPLETED).done
            interrupts.check()
            lost = None
            for future in ended:
                index, number = running.pop(future)
                found, why = _found(future)
                lost = why or lost
                if why and number < MOST_ATTEMPTS:
                    waiting.append((index, number + 1))
                else:
                    yield index, Fault(f"its worker is gone: {why}") if why else found
            if lost and not backend.revive():
                for index, _ in [*running.values(), *waiting]:
                    yield index, Fault(f"its worker is gone: {lost}")
                return


def _called(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """A call on a worker: a refusal as plain values, since exceptions lose their fields on the way."""
    try:
        return "done", function(*arguments)
    except ShotError as error:
        return "refused", error.as_dict()
    except Exception as error:
        return "failed", f"{type(error).__name__}: {error}"


def _found(future: Future[Any]) -> tuple[Any, str]:
    """What a call gave, and why there is nothing; empty where there is something."""
    try:
        outcome, value = future.result()
    except (Exception, CancelledError) as error:
        return None, f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    if outcome == "refused":
        fields = dict(value)
        return ShotError(fields.pop("problem"), **fields | {"found": fields["found"] or None}), ""
    return (value if outcome == "done" else Fault(value)), ""
