"""One attempt at a job, on any worker: a process of its own runs the command line.

Workers import this module alone; what it gets and returns are plain values.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import subprocess  # nosec B404  # runs this program
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import IO, Any

from calmotion.support.files import write_text
from calmotion.workflow.batch import child
from calmotion.workflow.batch.jobs import Job, is_done, mark_done

DONE, FAILED, DIED = "done", "failed", "died"
MARK = "=== attempt on "  # begins the lines of a log by which attempts are counted
_INTERRUPTED = 130
_WRONG_USAGE = 2
_WAIT = 0.5  # between two looks at a lock that another process has [s]
_RUNNING: set[subprocess.Popen[str]] = set()
_GUARD = threading.Lock()


def attempt(fields: Mapping[str, Any], cores: tuple[int, ...] = ()) -> dict[str, Any]:
    """Run a job, where nobody has done that meanwhile.

    Args:
        fields: Of the job, see `Job.as_dict`.
        cores: Processors that it may use; none: all of the worker.

    Returns:
        `outcome` (`done`, `failed` for a reason that another attempt would meet too, or `died`), `problem`, `report`
        (the object of `--json`, or None), `wall_s`, `processor_s` (of its process; None where that is unknown), `host`.
    """
    job, begin, used = Job.of(fields), time.perf_counter(), None
    os.makedirs(os.path.dirname(job.log), exist_ok=True)
    with _locked(job.lock) as descriptor:
        if is_done(job):  # by a worker that was thought to be dead
            found: dict[str, Any] = {"outcome": DONE, "problem": None, "report": _read(job.report)}
        else:
            status, text, used = _run(job, cores, descriptor)
            found = _judged(job, status, text)
    return found | {"wall_s": time.perf_counter() - begin, "processor_s": used, "host": platform.node()}


def kill_running() -> None:
    """End the processes that attempts in this process run; nothing of them is written any more."""
    with _GUARD:
        for process in _RUNNING:
            with contextlib.suppress(OSError):
                process.kill()


def _run(job: Job, cores: tuple[int, ...], lock: int | None) -> tuple[int, str, float | None]:
    """Exit status of the command line, what it printed on stdout, and its processor time [s]."""
    environment = {**os.environ, **job.environment}
    if cores:
        environment[child.CORES] = ",".join(map(str, cores))
    with open(job.log, "a", encoding="utf-8") as log:
        log.write(f"{MARK}{platform.node()}, {datetime.now(UTC).isoformat(timespec='seconds')}\n")
        log.flush()
        process = _started(job, environment, log, lock)
        with _GUARD:
            _RUNNING.add(process)
        try:
            assert process.stdout is not None and process.stdin is not None
            text = process.stdout.read()  # stdin stays open: its end ends the process
            status, used = _ended(process)
        finally:
            with _GUARD:
                _RUNNING.discard(process)
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    stream.close()
    return status, text, used


def _ended(process: subprocess.Popen[str]) -> tuple[int, float | None]:
    """Wait for a process: its exit status, and its processor time with that of what it started [s]."""
    if hasattr(os, "wait4"):
        with contextlib.suppress(ChildProcessError):  # whoever ended it has waited for it
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, usage.ru_utime + usage.ru_stime
    return process.wait(), None


def _started(job: Job, environment: dict[str, str], log: IO[str], lock: int | None) -> subprocess.Popen[str]:
    return subprocess.Popen(  # nosec B603  # no shell
        [sys.executable, "-m", child.__name__, *job.line],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True, encoding="utf-8", env=environment,
        start_new_session=True,  # an interrupt of the terminal is the batch's to answer
        pass_fds=() if lock is None else (lock,),  # it is locked as long as the process runs
    )  # fmt: skip


def _judged(job: Job, status: int, text: str) -> dict[str, Any]:
    """The outcome of a process that has ended."""
    try:
        report = json.loads(text)
    except ValueError:
        report = None
    if report is not None:
        write_text(job.report, text)
    if status == 0 and report is not None:
        mark_done(job)
        return {"outcome": DONE, "problem": None, "report": report}
    if status in (1, 2) and report is not None:
        return {"outcome": FAILED, "problem": _problem(report), "report": report}
    if status == _WRONG_USAGE:
        wrong = {"problem": "an argument of the command does not fit", "remedy": f"See {job.log}"}
        return {"outcome": FAILED, "problem": wrong, "report": None}
    if status == _INTERRUPTED:
        problem = "the process was asked to end"
    else:
        problem = f"the process ended by signal {-status}" if status < 0 else f"the process ended with status {status}"
    return {"outcome": DIED, "problem": {"problem": problem, "remedy": f"See {job.log}"}, "report": None}


def _problem(report: Mapping[str, Any]) -> dict[str, Any]:
    """Why a command refused: its first error, or with `--strict` its verdict."""
    if isinstance(report.get("error"), dict):
        return dict(report["error"])
    return {
        "problem": "the simulation does not keep the tolerance", "path": "", "attribute": "tolerance_kept",
        "found": str(report.get("tolerance_kept")), "remedy": "See the error budget, or raise --tolerance",
    }  # fmt: skip


def _read(path: str) -> dict[str, Any] | None:
    try:
        with open(path, encoding="utf-8") as file:
            report = json.load(file)
    except (OSError, ValueError):
        return None
    return report if isinstance(report, dict) else None


@contextlib.contextmanager
def _locked(path: str) -> Iterator[int | None]:
    """A lock that no two attempts at a job have at once, on any machine; where the system has none, nothing.

    Yields:
        Its descriptor. A process that inherits it keeps the lock until it ends, also where this process is killed.
    """
    try:
        import fcntl
    except ImportError:
        yield None
        return
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        while True:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                time.sleep(_WAIT)
        yield descriptor
    finally:
        os.close(descriptor)
