"""Runs the jobs of a batch: what is done is kept, what dies is tried again, what fails for a reason is not."""

import json
import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from numbers import Integral
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.support import Fault, answer, try_writing, write_text
from calmotion.workflow import Progress, plain
from filelock import FileLock, Timeout

from .attempt import attempt, attempts, kill_running, stored_report
from .jobs import EXTRAS, LOGS, Job, forget, is_done, jobs_for
from .report import DIED, KEPT, WAITING, BatchResult, JobResult
from .workers import LOCAL, executor_on, finished, refuse_unknown_place, result_of

MOST_ATTEMPTS = 3
REPORT, LOCK = "batch.json", ".batch.lock"
_STAGE = "Batch"


# parameters: one for each option of the command, all but the shots and the folder by keyword
def batch(
    shots: Sequence[str | os.PathLike[str]] | str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    command: str = "optimize",
    arguments: Sequence[str] = (),
    extras: Sequence[str] = (),
    on: str = LOCAL,
    workers: int | None = None,
    environment: Mapping[str, str] | None = None,
    progress: Callable[[Progress], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> BatchResult:
    """Run `calmotion optimize` or `calmotion simulate` on many shots.

    The folder gets a layer and a manifest for each shot, logs, and the report as `batch.json`, which is up to date
    while the batch runs. The same call goes on after an interruption: a shot is not run again while its inputs, its
    request and its outputs are unchanged.

    Args:
        shots: USD files, or one.
        folder: Of the results; workers elsewhere see it under the same path.
        command: `optimize` or `simulate`.
        arguments: Options of that command, such as `("--tolerance", "1mm")`.
        extras: Further outputs of each shot: `csv`, `rrd`, `figures`, `video`.
        on: `local` or `dask://HOST:PORT`.
        workers: Most jobs at once; None: one for each processor (local), or all.
        environment: Variables of the jobs' processes.
        progress: Called with a `Progress`.
        cancel: Called often; the batch stops when it returns True.

    Raises:
        ShotError: The shots cannot be a batch, the backend does not answer, or another batch runs in this folder.
        SettingError: An argument does not fit.
    """
    target = os.path.abspath(os.fspath(folder))
    shots = (shots,) if isinstance(shots, (str, os.PathLike)) else shots
    arguments, extras = ((given,) if isinstance(given, str) else given for given in (arguments, extras))
    unknown = [name for name in extras if name not in EXTRAS]
    if unknown or (workers is not None and not (isinstance(workers, Integral) and workers > 0)):
        raise SettingError(
            "a batch does not support this",
            path="extras" if unknown else "--workers",
            found=unknown[0] if unknown else workers,
            remedy=f"Use {', '.join(EXTRAS)}" if unknown else "Use 1 or more",
        )
    jobs = jobs_for(shots, target, command, arguments, extras, dict(environment or {}))
    return run_jobs(jobs, target, command, on, workers, progress, cancel)


def run_jobs(
    jobs: Sequence[Job], target: str, command: str, on: str = LOCAL, workers: int | None = None,
    progress: Callable[[Progress], None] | None = None, cancel: Callable[[], bool] | None = None,
) -> BatchResult:  # fmt: skip
    """Run jobs that may differ in more than their shots; arguments and errors as of `batch`.

    Args:
        target: Folder of the results, absolute.
    """
    begin = time.perf_counter()
    refuse_unknown_place(on)
    try:
        try_writing(Path(target) / LOGS / "file")
    except OSError as error:
        raise SettingError(
            "the folder cannot be written", path="-o", found=f"{target}: {error.strerror}", remedy="Choose another."
        ) from error
    with _alone(target):
        state = _State(jobs, target, command, on, begin, progress)
        left = [job for job in jobs if not state.keep(job)]
        state.write()
        if left:
            try:
                with executor_on(on, workers, kill_running) as (executor, limit):
                    _work(executor, limit, left, state, cancel)
            except KeyboardInterrupt:
                answer()
                state.interrupted = True
        return state.write()


class _State:
    """What is known of all jobs, kept on the disk while the batch runs."""

    def __init__(
        self, jobs: Sequence[Job], folder: str, command: str, on: str, begin: float,
        progress: Callable[[Progress], None] | None,
    ):  # fmt: skip
        self.jobs, self.interrupted = jobs, False
        self._folder, self._command, self._on, self._begin, self._progress = folder, command, on, begin, progress
        self._results = {job.name: JobResult(job, WAITING) for job in jobs}

    def keep(self, job: Job) -> bool:
        """Take over what is done already."""
        if not is_done(job):
            forget(job)
            return False
        self._results[job.name] = JobResult(job, KEPT, report=stored_report(job))
        return True

    def add(self, result: JobResult) -> None:
        """Take the result of a job."""
        self._results[result.job.name] = result
        self.write()

    def write(self) -> BatchResult:
        """Write the report; what there is so far."""
        wall = time.perf_counter() - self._begin
        results = [self._results[job.name] for job in self.jobs]
        found = BatchResult(self._folder, self._command, self._on, results, wall, self.interrupted)
        write_text(os.path.join(self._folder, REPORT), json.dumps(plain(found.report()), indent=2) + "\n")
        return found

    def show(self) -> None:
        """Tell how many jobs are done."""
        if self._progress is None:
            return
        ended = sum(result.outcome != WAITING for result in self._results.values())
        kept = sum(result.outcome == KEPT for result in self._results.values())
        elapsed, done = time.perf_counter() - self._begin, ended - kept
        more = elapsed * (len(self.jobs) - ended) / done if done else None
        self._progress(Progress(_STAGE, ended / len(self.jobs), f"{ended} of {len(self.jobs)} shots", more))

    @property
    def unfinished(self) -> list[Job]:
        """Jobs without an outcome."""
        return [result.job for result in self._results.values() if result.outcome == WAITING]


def _work(
    executor: Executor, limit: int | None, jobs: Sequence[Job], state: _State, cancel: Callable[[], bool] | None
) -> None:
    """Run jobs until each has a result."""
    calls = deque[tuple[Any, ...]]((attempt, job) for job in jobs)
    for ended in finished(executor, calls, limit):
        if cancel is not None and cancel():
            raise KeyboardInterrupt
        if ended is not None:
            (_, job), future = ended
            found = result_of(future)
            if isinstance(found, Fault):
                found = JobResult(job, DIED, attempts(job), problem={"problem": found.reason, "remedy": "Run it again"})
                if future.cancelled():  # all of them are
                    for job in state.unfinished:
                        state.add(replace(found, job=job, attempts=attempts(job)))
                    return
            elif found.outcome == DIED and found.attempts < MOST_ATTEMPTS:
                calls.append((attempt, job))
                continue
            state.add(found)
        state.show()


@contextmanager
def _alone(folder: str) -> Iterator[None]:
    """Hold the lock of a folder of results.

    Raises:
        ShotError: Another batch holds it.
    """
    lock = FileLock(os.path.join(folder, LOCK), timeout=0)
    try:
        lock.acquire()
    except Timeout as error:
        raise ShotError(
            "another batch runs in this folder", path=folder, remedy="Wait for its end, or choose another folder"
        ) from error
    try:
        yield
    finally:
        lock.release()
