"""A Dask scheduler and its workers on this machine, for measurements: each worker has one processor of its own."""

from __future__ import annotations

import importlib.util
import os
import signal
import socket
import subprocess  # nosec B404  # runs the scheduler and the workers
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from calmotion.errors import ShotError

HOST = "127.0.0.1"
_PATIENCE = 60.0  # until a scheduler answers [s]
# a program that binds itself to the processors of its first argument, then is another one
_BOUND = (
    "import os, sys\n"
    "cores = {int(core) for core in sys.argv[1].split(',') if core}\n"
    "if cores and hasattr(os, 'sched_setaffinity'): os.sched_setaffinity(0, cores)\n"
    "os.execv(sys.executable, [sys.executable, '-m', *sys.argv[2:]])\n"
)


class Cluster:
    """A scheduler and workers, as `dask scheduler` and `dask worker` start them.

    Attributes:
        address: `dask://HOST:PORT`.
        workers: The processes of the workers.

    Args:
        folder: For their logs and files.
        workers: How many.

    Raises:
        ShotError: `distributed` is not installed, or the scheduler does not answer.
    """

    def __init__(self, folder: Path, workers: int):
        if importlib.util.find_spec("distributed") is None:
            raise ShotError(
                "distributed is not installed", path="distributed", remedy="pip install 'calmotion[dask]'"
            )  # fmt: skip
        self._folder, self._count, self._port = folder, workers, _free_port()
        self.address = f"dask://{HOST}:{self._port}"
        self.workers: list[subprocess.Popen[bytes]] = []
        self.start()

    def start(self) -> None:
        """Start the scheduler, on the port that it had before, and the workers."""
        cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
        self._scheduler = self._started(
            [], "scheduler", "distributed.cli.dask_scheduler", "--host", HOST, "--port", str(self._port),
            "--no-dashboard", "--no-show",
        )  # fmt: skip
        self._await()
        for k in range(self._count):
            line = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(self._folder)]
            self.workers.append(
                self._started(
                    cores[k : k + 1], f"worker{k}", "distributed.cli.dask_worker", f"tcp://{HOST}:{self._port}", *line
                )
            )  # fmt: skip
        from distributed import Client

        with Client(f"tcp://{HOST}:{self._port}", timeout=_PATIENCE) as client:
            client.wait_for_workers(self._count, timeout=_PATIENCE)

    def kill_worker(self, number: int) -> None:
        """End a worker with -9."""
        _kill([self.workers.pop(number)])

    def kill_scheduler(self) -> None:
        """End the scheduler as a power cut does, and the workers, which do nothing without it."""
        _kill([self._scheduler, *self.workers])
        self.workers = []

    def close(self) -> None:
        """End all."""
        self.kill_scheduler()

    def _started(self, cores: Sequence[int], name: str, *line: str) -> subprocess.Popen[bytes]:
        with open(self._folder / f"{name}.log", "ab") as log:
            bound = [sys.executable, "-c", _BOUND, ",".join(map(str, cores)), *line]
            return subprocess.Popen(bound, stdin=subprocess.DEVNULL, stdout=log, stderr=log)  # nosec B603  # no shell

    def _await(self) -> None:
        end = time.monotonic() + _PATIENCE
        while time.monotonic() < end and self._scheduler.poll() is None:
            with socket.socket() as probe:
                probe.settimeout(1.0)
                if probe.connect_ex((HOST, self._port)) == 0:
                    return
            time.sleep(0.1)
        raise ShotError(
            "the Dask scheduler does not start", path=self.address, remedy=f"See {self._folder / 'scheduler.log'}"
        )


def _kill(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    """End processes with -9, so that they can clean up nothing."""
    for process in processes:
        if process.poll() is None:
            os.kill(process.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
        process.wait()


def _free_port() -> int:
    with socket.socket() as found:
        found.bind((HOST, 0))
        return int(found.getsockname()[1])
