"""Where the jobs of a batch run, each behind the interface of `concurrent.futures.Executor`."""

from __future__ import annotations

import os
import queue
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.support.processes.workers import Fault, results_of
from calmotion.version import __version__
from calmotion.workflow.batch.attempt import attempt, kill_running

LOCAL, DASK = "local", "dask"
_PATIENCE = 60.0  # for a scheduler that was there before [s]


class Backend(ABC):
    """Where jobs run.

    Attributes:
        limit: Most jobs that are submitted at once; None: all.
    """

    limit: int | None = None

    @abstractmethod
    def submit(self, fields: dict[str, Any], avoid: str) -> Future[dict[str, Any]]:
        """Run `attempt` somewhere.

        Args:
            fields: Of the job.
            avoid: The worker on which an attempt died (`worker` of what an attempt returned), or empty.
        """

    @abstractmethod
    def call(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Call a function of a module somewhere; the future has an exception where its worker is lost, or its own."""

    def revive(self) -> bool:
        """Open it again after futures were lost with it; whether that was possible."""
        return True

    @abstractmethod
    def close(self) -> None:
        """Give up what still runs, as far as that is possible."""


class LocalBackend(Backend):
    """Processes of this machine, with a share of its processors each.

    Args:
        workers: How many run at once.
    """

    def __init__(self, workers: int):
        cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
        self.limit = workers
        self._executor = ThreadPoolExecutor(workers, thread_name_prefix="calmotion-batch")
        self._shares: queue.SimpleQueue[tuple[int, ...]] = queue.SimpleQueue()
        for k in range(workers):
            self._shares.put(tuple(cores[k::workers]) if 1 < workers <= len(cores) else ())

    def submit(self, fields: dict[str, Any], avoid: str) -> Future[dict[str, Any]]:
        return self._executor.submit(self._in_share, fields)

    def _in_share(self, fields: dict[str, Any]) -> dict[str, Any]:
        cores = self._shares.get()
        try:
            return attempt(fields, cores)
        finally:
            self._shares.put(cores)

    def call(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        return self._executor.submit(self._called_in_share, function, arguments)

    def _called_in_share(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        cores = self._shares.get()
        try:
            ((_, found),) = results_of(_bound, [(cores, function, arguments)])
        finally:
            self._shares.put(cores)
        if isinstance(found, Fault):
            raise RuntimeError(found.reason)
        return found

    def close(self) -> None:
        self._executor.shutdown(wait=False, cancel_futures=True)
        kill_running()
        self._executor.shutdown(wait=True)


class DaskBackend(Backend):
    """The workers of a Dask scheduler.

    Args:
        address: `HOST:PORT`.
        workers: Most jobs at once; None: as many as the workers have threads.

    Raises:
        ShotError: `distributed` is not installed, or the scheduler does not answer, has no workers, or has workers
            with another version of Calmotion.
    """

    def __init__(self, address: str, workers: int | None):
        self.limit, self._address = workers, address
        self._client = self._connected(10.0)
        with suppress(TimeoutError, OSError):  # workers may start together with the batch
            self._client.wait_for_workers(1, timeout=_PATIENCE)
        versions = self._client.run(_version)
        wrong = {name: found for name, found in versions.items() if found != __version__}
        if wrong or not versions:
            self._client.close()
            name, found = next(iter(wrong.items()), ("", "none"))
            raise ShotError(
                "a worker has another version of Calmotion" if wrong else "the scheduler has no worker",
                path=name or f"dask://{address}",
                found=found,
                remedy=f"Install Calmotion {__version__} there" if wrong else f"Start one: dask worker {address}",
            )

    def submit(self, fields: dict[str, Any], avoid: str) -> Future[dict[str, Any]]:
        others = [name for name in self._client.scheduler_info(n_workers=-1)["workers"] if name != avoid]
        where = {"workers": others, "allow_other_workers": True} if avoid and others else {}
        executor: Executor = self._client.get_executor(pure=False, retries=0, **where)
        return executor.submit(_on_dask, fields)

    def call(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        executor: Executor = self._client.get_executor(pure=False, retries=0)
        return executor.submit(function, *arguments)

    def revive(self) -> bool:
        end = time.monotonic() + _PATIENCE
        if self._client.status == "running":  # a worker was lost, not the scheduler
            return True
        self._client.close(timeout=1)
        while time.monotonic() < end:
            try:
                self._client = self._connected(5.0)
            except ShotError:
                time.sleep(1.0)
            else:
                return True
        return False

    def close(self) -> None:
        self._client.close(timeout=5)

    def _connected(self, seconds: float) -> Any:
        try:
            from distributed import Client
        except ImportError as error:
            raise ShotError(
                "distributed is not installed", path="distributed", remedy="pip install 'calmotion[dask]'"
            ) from error
        try:
            client: Any = Client
            return client(f"tcp://{self._address}", timeout=seconds, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise ShotError(
                "the Dask scheduler does not answer", path=f"dask://{self._address}", found=str(error) or None,
                remedy="Start it (dask scheduler) and name its address",
            ) from error  # fmt: skip


def backend_for(on: str, workers: int | None) -> Backend:
    """The backend that a text names.

    Args:
        on: `local` or `dask://HOST:PORT`.
        workers: Most jobs at once; None: one for each processor (local), or as many as there is room for.

    Raises:
        SettingError: There is no such backend.
        ShotError: It is not there.
    """
    refuse_unknown_place(on)
    if on == LOCAL:
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        return LocalBackend(workers or cores)
    return DaskBackend(on.partition("://")[2], workers)


def refuse_unknown_place(on: str) -> None:
    """Refuse the name of a backend that there is not, as `backend_for` does, before a batch writes anything.

    Raises:
        SettingError: There is none of that name.
    """
    kind, _, rest = on.partition("://")
    if on == LOCAL or (kind == DASK and rest):
        return
    remedy = "Use local or dask://HOST:PORT"
    if on.startswith("slurm"):
        remedy = "Start Dask in Slurm (SLURMCluster of dask-jobqueue), and use dask://HOST:PORT of its scheduler"
    raise SettingError("a batch cannot run there", path="--on", found=on, remedy=remedy)


def _version() -> str:
    return __version__


def _bound(cores: tuple[int, ...], function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """A call in a process that uses these processors alone; none: all."""
    if cores and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, set(cores))
    return function(*arguments)


def _on_dask(fields: dict[str, Any]) -> dict[str, Any]:
    """`attempt` on a worker of Dask, with its address."""
    from distributed import get_worker

    return attempt(fields) | {"worker": get_worker().address}
