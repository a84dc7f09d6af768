"""Work in processes of its own, so that one that crashes, hangs or takes all memory costs its own result only."""

import multiprocessing
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from calmotion.support.memory import available_memory

MEMORY = 2e9  # that a worker may need [bytes]: no more are started than there is memory for
_LOOK = 5.0  # between looks at workers that take too long [s]


@dataclass(frozen=True)
class Fault:
    """Work without a result.

    Attributes:
        reason: What happened, as a part of a sentence.
    """

    reason: str


class _Worker:
    """A process that does one piece of work after the other."""

    def __init__(self, function: Callable[..., Any]) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would copy threads and locks of this process
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, function), daemon=True)
        self.process.start()
        theirs.close()
        self.index: int | None = None
        self.since = 0.0

    def give(self, index: int, arguments: tuple[Any, ...]) -> None:
        self.index, self.since = index, time.monotonic()
        self.connection.send(arguments)

    def end(self) -> None:
        self.process.kill()
        self.process.join()
        self.connection.close()


def results_of(
    function: Callable[..., Any], work: Sequence[tuple[Any, ...]], jobs: int = 1, patience: float = float("inf")
) -> Iterator[tuple[int, Any]]:
    """The results of a function, in the order in which they are ready, each with the index of its work.

    Args:
        function: Of a module, so that a process can import it; runs in processes that are kept from one piece of work
            to the next.
        work: Arguments of each call; they and the results must be picklable.
        jobs: Number of processes at most; fewer where memory is short.
        patience: After which a process is ended [s].

    Yields:
        A `Fault` instead of a result where the function raised an exception, its process ended, or took too long.
    """
    left = deque(range(len(work)))
    count = max(1, min(jobs, len(work), int(min(available_memory() / MEMORY, 1e6))))
    workers: list[_Worker] = []
    try:
        while left or any(worker.index is not None for worker in workers):
            for worker in workers:
                if worker.index is None and left:
                    index = left.popleft()
                    worker.give(index, work[index])
            while left and len(workers) < count:
                workers.append(_Worker(function))
                index = left.popleft()
                workers[-1].give(index, work[index])
            wait([worker.connection for worker in workers if worker.index is not None], _LOOK)
            for worker in list(workers):
                found = _result(worker, patience)
                if found is None:
                    continue
                if isinstance(found[1], Fault) and not worker.process.is_alive():
                    worker.end()
                    workers.remove(worker)
                yield found
    finally:
        for worker in workers:
            worker.end()


def _result(worker: _Worker, patience: float) -> tuple[int, Any] | None:
    """What a worker has to say of its work; None where it is idle or still at it."""
    if worker.index is None:
        return None
    index = worker.index
    if worker.connection.poll():
        worker.index = None
        try:
            return index, worker.connection.recv()
        except (EOFError, OSError):
            worker.process.join()
            return index, Fault(f"its process ended ({_status(worker.process.exitcode)})")
    if time.monotonic() - worker.since > patience:
        worker.index = None
        worker.process.kill()
        worker.process.join()
        return index, Fault(f"it did not end within {patience:.0f} s")
    return None


def _status(code: int | None) -> str:
    if code is not None and code < 0:
        return f"signal {signal.Signals(-code).name}"
    return f"exit status {code}"


def _serve(connection: Connection, function: Callable[..., Any]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that started this one ends it
    while True:
        try:
            arguments = connection.recv()
        except EOFError:
            return
        try:
            result: Any = function(*arguments)
        except Exception as error:
            result = Fault(f"{type(error).__name__}: {error}")
        connection.send(result)
