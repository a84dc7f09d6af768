"""Runs the jobs of a batch: what is done is kept, what dies is tried again, what fails for a reason is not."""

from __future__ import annotations

import json
import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import contextmanager
from numbers import Integral
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.support import interrupts
from calmotion.support.files import try_writing, write_text
from calmotion.workflow.batch.attempt import DIED, MARK
from calmotion.workflow.batch.backends import LOCAL, Backend, backend_for, refuse_unknown_place
from calmotion.workflow.batch.jobs import EXTRAS, LOGS, Job, forget, is_done, jobs_for
from calmotion.workflow.batch.report import KEPT, WAITING, BatchResult, JobResult
from calmotion.workflow.plain import plain
from calmotion.workflow.run import Progress

MOST_ATTEMPTS = 3
MOST_REVIVALS = 3  # of a scheduler
REPORT, PAGE, LOCK = "batch.json", "batch.md", ".batch.lock"
_TICK = 0.5  # [s]
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

    The folder gets a layer and a manifest for each shot, logs, and the report as `batch.json` and `batch.md`, which
    are up to date while the batch runs. The same call goes on after an interruption: a shot is not run again while its
    inputs, its request and its outputs are unchanged.

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
            "a batch does not support this", path="extras" if unknown else "--workers",
            found=unknown[0] if unknown else workers, remedy=f"Use {', '.join(EXTRAS)}" if unknown else "Use 1 or more",
        )  # fmt: skip
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
            backend = backend_for(on, workers)
            try:
                _work(backend, left, state, cancel)
            except KeyboardInterrupt:
                interrupts.answer()
                state.interrupted = True
            finally:
                with interrupts.deferred():
                    backend.close()
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
        try:
            report = json.loads(Path(job.report).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            report = None
        self._results[job.name] = JobResult(job, KEPT, report=report)
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
        write_text(os.path.join(self._folder, PAGE), found.page())
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


def _work(backend: Backend, jobs: Sequence[Job], state: _State, cancel: Callable[[], bool] | None) -> None:
    """Run jobs until each has a result."""
    waiting, running, revivals = deque((job, "") for job in jobs), dict[Future[dict[str, Any]], Job](), 0
    while waiting or running:
        while waiting and (backend.limit is None or len(running) < backend.limit):
            job, avoid = waiting.popleft()
            running[backend.submit(job.as_dict(), avoid)] = job
        ended = wait(running, timeout=_TICK, return_when=FIRST_COMPLETED).done
        interrupts.check()
        if cancel is not None and cancel():
            raise KeyboardInterrupt
        lost = False
        for future in ended:
            job, found = running.pop(future), _outcome(future)
            lost |= found is None
            found = found or {"outcome": DIED, "problem": {"problem": f"its worker is gone: {_why(future)}"}}
            attempts = _attempts(job)
            if found["outcome"] == DIED and attempts < MOST_ATTEMPTS:
                waiting.append((job, found.get("worker", "")))
                continue
            state.add(_result(job, found, max(1, attempts)))
        state.show()
        if lost:
            revivals += 1
            if revivals > MOST_REVIVALS or not backend.revive():
                gone = {"outcome": DIED, "problem": {"problem": "its workers are gone", "remedy": "Run it again"}}
                for job in [*running.values(), *(job for job, _ in waiting)]:
                    state.add(_result(job, gone, _attempts(job)))
                return


def _outcome(future: Future[dict[str, Any]]) -> dict[str, Any] | None:
    """What an attempt returned; None where its worker, or the scheduler, was lost."""
    try:
        return future.result()
    except (Exception, CancelledError):
        return None


def _why(future: Future[dict[str, Any]]) -> str:
    if future.cancelled():
        return "the scheduler has lost it"
    error = future.exception()
    return f"{type(error).__name__}: {error}" if error is not None else ""


def _result(job: Job, found: Mapping[str, Any], attempts: int) -> JobResult:
    return JobResult(
        job, found["outcome"], attempts, found.get("wall_s", 0.0), found.get("problem"), found.get("report"),
        found.get("host", ""), found.get("processor_s"), found.get("worker", ""),
    )  # fmt: skip


def _attempts(job: Job) -> int:
    """How often a job was begun, by its log: schedulers try again on their own as well."""
    try:
        with open(job.log, encoding="utf-8", errors="replace") as log:
            return sum(line.startswith(MARK) for line in log)
    except OSError:
        return 0


@contextmanager
def _alone(folder: str) -> Iterator[None]:
    """Hold the lock of a folder of results.

    Raises:
        ShotError: Another batch holds it.
    """
    try:
        import fcntl
    except ImportError:  # a system without such locks
        yield
        return
    with open(os.path.join(folder, LOCK), "w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ShotError(
                "another batch runs in this folder", path=folder, remedy="Wait for its end, or choose another folder"
            ) from error
        yield
