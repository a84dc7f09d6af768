"""One attempt at a job, on any worker: a process of its own runs the command line."""

import contextlib
import json
import os
import platform
import subprocess  # nosec B404  # runs this program
import sys
import threading
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from calmotion.support import write_text

from . import child
from .jobs import Job, is_done, mark_done
from .report import DIED, DONE, FAILED, JobResult

MARK = "=== attempt on "  # begins the lines of a log by which attempts are counted
_REFUSED = (1, 2)  # exit statuses of a command that says why
_INTERRUPTED = 130
_RUNNING: set[subprocess.Popen[str]] = set()
_GUARD = threading.Lock()


def attempt(job: Job) -> JobResult:
    """Run a job: `done`, `failed` for a reason that another attempt would meet too, or `died`."""
    begin, used = time.perf_counter(), None
    if is_done(job):  # by a worker that was lost afterwards
        outcome, problem, report = DONE, None, stored_report(job)
    else:
        os.makedirs(os.path.dirname(job.log), exist_ok=True)
        status, text, used = _run(job)
        outcome, problem, report = _judged(job, status, text)
    return JobResult(
        job, outcome, attempts(job), time.perf_counter() - begin, problem, report, platform.node(), used, _worker()
    )


def attempts(job: Job) -> int:
    """How often a job was begun, by its log: Dask tries again on its own as well."""
    try:
        with open(job.log, encoding="utf-8", errors="replace") as log:
            return sum(line.startswith(MARK) for line in log)
    except OSError:
        return 0


def stored_report(job: Job) -> dict[str, Any] | None:
    """What the command has printed as JSON in an earlier run; None where that is lost."""
    try:
        report = json.loads(Path(job.report).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return report if isinstance(report, dict) else None


def kill_running() -> None:
    """End the processes that attempts in this process run; nothing of them is written any more."""
    with _GUARD:
        for process in _RUNNING:
            with contextlib.suppress(OSError):
                process.kill()


def _run(job: Job) -> tuple[int, str, float | None]:
    """Exit status of the command line, what it printed on stdout, and its processor time [s]."""
    with open(job.log, "a", encoding="utf-8") as log:
        log.write(f"{MARK}{platform.node()}, {datetime.now(UTC).isoformat(timespec='seconds')}\n")
        log.flush()
        process = subprocess.Popen(  # nosec B603  # no shell
            [sys.executable, "-m", child.__name__, *job.line],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True, encoding="utf-8",
            env={**os.environ, **job.environment},
            start_new_session=True,  # an interrupt of the terminal is the batch's to answer
        )  # fmt: skip
        with _GUARD:
            _RUNNING.add(process)
        with process:  # stdin stays open: its end ends the process
            try:
                assert process.stdout is not None
                text = process.stdout.read()
                status, used = _ended(process)
            finally:
                with _GUARD:
                    _RUNNING.discard(process)
                process.kill()
    return status, text, used


def _ended(process: subprocess.Popen[str]) -> tuple[int, float | None]:
    """Wait for a process: its exit status, and its processor time with that of what it started [s]."""
    if hasattr(os, "wait4"):
        with contextlib.suppress(ChildProcessError):  # whoever ended it has waited for it
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, usage.ru_utime + usage.ru_stime
    return process.wait(), None


def _judged(job: Job, status: int, text: str) -> tuple[str, dict[str, Any] | None, dict[str, Any] | None]:
    """Outcome, problem and report of a process that has ended."""
    try:
        report = json.loads(text)
    except ValueError:
        report = None
    if report is not None:
        write_text(job.report, text)
    if status == 0 and report is not None:
        mark_done(job)
        return DONE, None, report
    if status in _REFUSED and report is not None:
        return FAILED, _problem(report), report
    remedy = {"remedy": f"See {job.log}"}
    if status == 2:
        return FAILED, {"problem": "an argument of the command does not fit"} | remedy, None
    if status == _INTERRUPTED:
        return DIED, {"problem": "the process was asked to end"} | remedy, None
    how = f"by signal {-status}" if status < 0 else f"with status {status}"
    return DIED, {"problem": f"the process ended {how}"} | remedy, None


def _problem(report: Mapping[str, Any]) -> dict[str, Any]:
    """Why a command refused: its first error, or with `--strict` its verdict."""
    if isinstance(report.get("error"), dict):
        return dict(report["error"])
    if report.get("tolerance_kept") and report.get("improved") is False:
        return {
            "problem": "the curves leave a larger error than the animation",
            "path": "",
            "attribute": "improved",
            "found": "False",
            "remedy": "See the limits of the motors; slow the animation down, or correct the limits",
        }
    return {
        "problem": "the simulation does not keep the tolerance",
        "path": "",
        "attribute": "tolerance_kept",
        "found": str(report.get("tolerance_kept")),
        "remedy": "See the error budget, or raise --tolerance",
    }


def _worker() -> str:
    """The address of the worker of Dask that this process is; empty where it is none."""
    if "distributed" not in sys.modules:
        return ""
    from distributed import get_worker

    try:
        return str(get_worker().address)
    except ValueError:
        return ""
