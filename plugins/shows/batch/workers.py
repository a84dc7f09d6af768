"""Where the jobs of a batch run: on this machine, or on the workers of a Dask scheduler.

Both are executors of `concurrent.futures`. Here, jobs are processes that threads wait for; Dask gives the work of a
worker that dies to another one.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from queue import SimpleQueue
from typing import Any

from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.support import Fault, check, deferred, processors, use_processors
from calmotion.version import __version__

LOCAL, _DASK = "local", "dask://"
_TICK = 0.5  # between two looks at work that goes on [s]
_CONNECT, _APPEAR = 10.0, 60.0  # for the scheduler, and for workers that start together with the batch [s]

Call = tuple[Any, ...]  # a function and its arguments


def refuse_unknown_place(on: str) -> None:
    """Refuse the name of a place that there is not.

    Raises:
        SettingError: It is neither `local` nor `dask://HOST:PORT`.
    """
    if on == LOCAL or (on.startswith(_DASK) and on != _DASK):
        return
    remedy = "Use local or dask://HOST:PORT"
    if on.startswith("slurm"):
        remedy = "Start Dask in Slurm (SLURMCluster of dask-jobqueue), and use dask://HOST:PORT of its scheduler"
    raise SettingError("a batch cannot run there", path="--on", found=on, remedy=remedy)


@contextmanager
def executor_on(
    on: str, workers: int | None, give_up: Callable[[], None] = lambda: None
) -> Iterator[tuple[Executor, int | None]]:
    """An executor; what still runs at the end is given up, as far as that is possible.

    Args:
        on: `local` or `dask://HOST:PORT`.
        workers: Most calls at once; None: one for each processor (local), or as many as there is room for.
        give_up: Ends what calls on this machine still wait for.

    Yields:
        The executor, and how many calls it may have at once; None: any number.

    Raises:
        SettingError: There is no such place.
        ShotError: `distributed` is not installed, or the scheduler does not answer, has no workers, or has workers with
            another version of Calmotion.
    """
    refuse_unknown_place(on)
    if on != LOCAL:
        with _client(on.removeprefix(_DASK)) as client:
            yield client.get_executor(pure=False, retries=0), workers
        return
    count, shares = workers or len(processors()), SimpleQueue[Sequence[int]]()
    for k in range(count):
        shares.put(processors()[k::count] if 1 < count <= len(processors()) else processors())
    executor = ThreadPoolExecutor(count, "calmotion-batch", _take_share, (shares,))
    try:
        yield executor, count
    finally:
        with deferred():
            executor.shutdown(wait=False, cancel_futures=True)
            give_up()
            executor.shutdown(wait=True)


def finished(executor: Executor, calls: deque[Call], limit: int | None) -> Iterator[tuple[Call, Future[Any]] | None]:
    """Run calls, to which more may be added meanwhile.

    Yields:
        Each call that has ended with its future; None now and then, for looks at other things.

    Raises:
        KeyboardInterrupt: The run is interrupted.
    """
    running: dict[Future[Any], Call] = {}
    while calls or running:
        while calls and (limit is None or len(running) < limit):
            call = calls.popleft()
            running[executor.submit(*call)] = call
        ended = wait(running, timeout=_TICK, return_when=FIRST_COMPLETED).done
        check()
        for future in ended:
            yield running.pop(future), future
        yield None


def result_of(future: Future[Any]) -> Any:
    """The result of a future; a `Fault` where it was lost with its workers or the scheduler, or has an exception."""
    try:
        return future.result()
    except CancelledError:
        return Fault("the scheduler is gone")
    except Exception as error:
        return Fault(f"its worker ended or failed: {type(error).__name__}: {error}")


@contextmanager
def _client(address: str) -> Iterator[Any]:
    """A client of a Dask scheduler whose workers have this version."""
    try:
        from distributed import Client
    except ImportError as error:
        raise ShotError("distributed is not installed", path="distributed", remedy="pip install distributed") from error
    try:
        client = Client(f"tcp://{address}", timeout=_CONNECT, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise ShotError(
            "the Dask scheduler does not answer",
            path=f"{_DASK}{address}",
            found=str(error) or None,
            remedy="Start it (dask scheduler) and name its address",
        ) from error
    try:
        with suppress(TimeoutError, OSError):
            client.wait_for_workers(1, timeout=_APPEAR)
        versions = client.run(_version)
        wrong = next((item for item in versions.items() if item[1] != __version__), None)
        if not versions:
            raise ShotError(
                "the scheduler has no worker", path=f"{_DASK}{address}", remedy=f"Start one: dask worker {address}"
            )
        if wrong is not None:
            raise ShotError(
                "a worker has another version of Calmotion",
                path=wrong[0],
                found=wrong[1],
                remedy=f"Install Calmotion {__version__} there",
            )
        yield client
    finally:
        with deferred():
            client.close(timeout=5)


def _take_share(shares: SimpleQueue[Sequence[int]]) -> None:
    """Bind a thread, and so the processes that it starts, to its share of the processors."""
    use_processors(shares.get())


def _version() -> str:
    return __version__
