"""Runs of the program: forked from a process that has imported it, or started anew; what ended them is recorded.

A fork spares the seconds of imports, which are most of a run, so that a thousand runs take less than an hour. Runs that
are started anew are killed while they import, too. Faults are installed in the child.
"""

import fcntl
import importlib
import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from workspace import REPOSITORY, Workspace

_PROGRAM = (
    "calmotion.cli.main", "calmotion.simulation.simulate", "calmotion.usd.reading", "calmotion.workflow.commands",
    "matplotlib.figure", "numba", "pxr.Usd", "pxr.UsdPhysics", "rerun", "scipy.sparse.linalg",
)  # fmt: skip
_PIPE = 2**20  # size of a pipe [bytes]
LIMIT = 1800.0  # a run that takes longer [s] is stuck, also on a machine that many programs share


@dataclass(frozen=True)
class Ending:
    """How a run ended.

    Attributes:
        status: Exit status; minus the number of the signal that ended it; None when it was stuck.
        out, err: What it printed.
        seconds: Processor time of it and of the processes that it started [s].
    """

    status: int | None
    out: str
    err: str
    seconds: float

    @property
    def text(self) -> str:
        """What it printed on stderr besides the progress."""
        return "\n".join(line for line in self.err.splitlines() if not line.startswith("progress\t"))


def load_program() -> None:
    """Import the parts of the program that all commands import."""
    sys.path.insert(0, str(REPOSITORY / "pipeline"))
    for name in _PROGRAM:
        importlib.import_module(name)


def load_modules(file: Path) -> None:
    """Import the modules that a run has listed, so that later runs are forked with them; each loads plugins anew."""
    for name in file.read_text().split():
        with suppress(ImportError):  # a plugin, or made by another module
            importlib.import_module(name)


def list_modules(file: Path) -> Callable[[], None]:
    """A fault that does no harm but lists the modules that a run has imported at its end."""

    def install() -> None:
        import atexit

        atexit.register(lambda: file.write_text("\n".join(sys.modules)))

    return install


@dataclass
class Started:
    """A run that goes on.

    Attributes:
        pid: Its process.
        pipes: Where its output is read: a file would be short where files are, and be filled by a full disk.
    """

    pid: int
    pipes: tuple[int, int]

    def send(self, number: int) -> None:
        """Send it a signal, if it still runs."""
        try:
            os.kill(self.pid, number)
        except ProcessLookupError:
            pass

    def wait_for(self, seconds: float) -> None:
        """Wait until it has taken some processor time [s], or has ended."""
        ended = os.WEXITED | os.WNOHANG | os.WNOWAIT
        while _work(self.pid) < seconds and os.waitid(os.P_PID, self.pid, ended) is None:
            time.sleep(0.02)

    def wait(self, limit: float = LIMIT) -> Ending:
        """Wait for its end, and end it when it is stuck."""
        status: int | None = None
        end, before = time.monotonic() + limit, _awaited()
        while True:
            pid, code = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                status = os.waitstatus_to_exitcode(code)
                break
            if time.monotonic() > end:
                os.kill(self.pid, signal.SIGKILL)
                os.waitpid(self.pid, 0)
                break
            time.sleep(0.005)
        seconds = _awaited() - before
        out, err = map(_drained, self.pipes)
        return Ending(status, out, err, seconds)


def _work(pid: int) -> float:
    """Processor time of a process and of those that it has awaited [s], see `man 5 proc`."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def _awaited() -> float:
    """Processor time of the processes that this one has awaited [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _drained(pipe: int) -> str:
    """What is in a pipe, which is closed."""
    parts = []
    os.set_blocking(pipe, False)
    with suppress(BlockingIOError):
        while part := os.read(pipe, _PIPE):
            parts.append(part)
    os.close(pipe)
    return b"".join(parts).decode(errors="replace")


def _pipe() -> tuple[int, int]:
    """The ends of a pipe that takes all that a run prints without being read."""
    ends = os.pipe()
    fcntl.fcntl(ends[1], fcntl.F_SETPIPE_SZ, _PIPE)
    return ends


def start(
    space: Workspace, arguments: list[str], fault: Callable[[], None] | None = None, cold: bool = False
) -> Started:
    """Start a run.

    Args:
        space: Where it runs.
        arguments: Its command line.
        fault: Called in the child before the program.
        cold: A new process in place of a fork; it takes no fault.
    """
    pipes = _pipe(), _pipe()
    written = pipes[0][1], pipes[1][1]
    if cold:
        environment = os.environ | space.environment() | {"PYTHONPATH": str(REPOSITORY / "pipeline")}
        process = subprocess.Popen(
            [sys.executable, "-m", "calmotion", *arguments], env=environment, stdout=written[0], stderr=written[1],
            stdin=subprocess.DEVNULL, cwd=space.root, preexec_fn=_default_signals, start_new_session=True,
        )  # fmt: skip
        process.returncode = 0  # it is awaited by its number
        pid = process.pid
    else:
        pid = os.fork()
        if pid == 0:
            _child(space, arguments, fault, written)
    for end in written:
        os.close(end)
    return Started(pid, (pipes[0][0], pipes[1][0]))


def run(space: Workspace, figures: bool = False, fault: Callable[[], None] | None = None, cold: bool = False) -> Ending:
    """Run the program to its end."""
    return start(space, space.arguments(figures), fault, cold).wait()


def _default_signals() -> None:
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_DFL)


def _child(space: Workspace, arguments: list[str], fault: Callable[[], None] | None, written: tuple[int, int]) -> None:
    """Become the program; never returns."""
    status = 70
    try:
        os.setsid()
        os.chdir(space.root)
        for descriptor, end in zip((1, 2), written, strict=True):
            os.dup2(end, descriptor)
        sys.stdout, sys.stderr = (os.fdopen(os.dup(number), "w", buffering=1) for number in (1, 2))
        sys.__stdout__, sys.__stderr__ = sys.stdout, sys.stderr
        _default_signals()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.argv = ["calmotion", *arguments]
        random.seed()
        from calmotion.__main__ import main

        if fault is not None:
            fault()
        status = main()
    except SystemExit as stop:
        status = stop.code if isinstance(stop.code, int) else 1
    except KeyboardInterrupt:
        status = 130
    except BaseException:
        import traceback

        traceback.print_exc()
        status = 1
    finally:
        import atexit

        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except (OSError, ValueError):
                pass
        os._exit(status)
