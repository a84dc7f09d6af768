"""Runs under a limit of the address space (`ulimit -v`): native code that dies or hangs there becomes an error.

USD, LLVM and OpenBLAS do not survive memory that they do not get: threads crash, `LLVM ERROR` aborts the process, and
OpenBLAS asks for a buffer for ever. Where there is such a limit, the program therefore runs in a child of a process
that loads nothing, passes signals on, and tells how the child ended. Elsewhere nothing is changed.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress

from calmotion.errors import ShotError
from calmotion.support.memory import address_limit

FAILED = 1
LIBRARIES = 1.3e9  # address space that Python, NumPy, SciPy, numba and USD take before a shot is read [bytes]
# Commands that load none of these.
LIGHT = ("--help", "-h", "--version", "cache", "completion", "doctor", "materials", "motors", "plugins")
_NATIVE = ("SIGSEGV", "SIGABRT", "SIGBUS", "SIGILL", "SIGTRAP")  # ends of native code that lacks memory
_ASKING = (signal.SIGINT, signal.SIGTERM)
_LOOK = 1.0  # between looks at a child that may hang [s]
_HANG = 20.0  # of work in the system for memory that is not there [s]
_BUFFER = 40e6  # the largest piece that OpenBLAS asks for at once, and a little more [bytes]
_ARENAS, _PARENT_DEATH_SIGNAL = -8, 1  # M_ARENA_MAX of malloc.h, PR_SET_PDEATHSIG of prctl.h


def guarded(arguments: Sequence[str]) -> int | None:
    """Let the program go on in a child where the address space is limited.

    Args:
        arguments: Those after the program's name.

    Returns:
        None where the caller is to go on: in the child, or where nothing is limited; else the exit status.
    """
    limit = address_limit()
    if limit == float("inf") or sys.platform != "linux":
        return None
    if limit < LIBRARIES and arguments and arguments[0] not in LIGHT and not {"-h", "--help"} & set(arguments):
        return _refuse(
            arguments, "the libraries of this command do not fit into the limit of memory", f"{limit / 1e9:.2f} GB",
            f"Raise the limit to {LIBRARIES / 1e9:.1f} GB and what the shot takes (ulimit -v), or lift it: "
            "ulimit -v unlimited",
        )  # fmt: skip
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    awaited = {signal.SIGCHLD, signal.SIGTSTP, *_ASKING, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, awaited)
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        _become_child(parent)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return None
    status, why = _end_of(child, awaited)
    if status >= 0:
        return status
    name = signal.Signals(-status).name
    if why or name in _NATIVE:
        return _refuse(
            arguments, "there is not enough memory: native code that gets none ended the run",
            f"{why or name} under a limit of {limit / 1e9:.2f} GB of address space",
            "Raise the limit (ulimit -v), or choose a larger tolerance or element size, or fewer outputs",
        )  # fmt: skip
    with suppress(OSError, ValueError):  # SIGKILL has no handler
        signal.signal(-status, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [-status])
    os.kill(os.getpid(), -status)
    return FAILED


def _refuse(arguments: Sequence[str], problem: str, found: str, remedy: str) -> int:
    from calmotion.cli.output import Output, print_error

    print_error(ShotError(problem, found=found, remedy=remedy), Output(sys.stdout, "--json" in arguments))
    return FAILED


def _become_child(parent: int) -> None:
    """End with the parent, get signals from it alone, and take less address space for the same memory."""
    import ctypes  # 4 ms, which runs without a limit do not need

    os.setpgid(0, 0)  # a terminal's Ctrl-C would come twice
    with suppress(AttributeError, OSError):
        library = ctypes.CDLL(None)
        library.prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)
        library.mallopt(_ARENAS, 1)  # each thread's arena takes 64 MB of it, also when it is empty
    if os.getppid() != parent:  # it ended before
        os._exit(FAILED)


def _end_of(child: int, awaited: set[signal.Signals]) -> tuple[int, str]:
    """Wait for a child and pass signals on; its exit status, or minus the signal that ended it, and why if it hung."""
    began = None
    while True:
        got = signal.sigtimedwait(awaited, _LOOK)
        number = got.si_signo if got is not None else 0
        pid, code = os.waitpid(child, os.WNOHANG)
        if pid:
            return os.waitstatus_to_exitcode(code), ""
        if number == signal.SIGTSTP:
            os.kill(child, signal.SIGSTOP)
            os.kill(os.getpid(), signal.SIGSTOP)
            os.kill(child, signal.SIGCONT)  # the shell has let this process go on
        elif number not in (0, signal.SIGCHLD):
            os.kill(child, number)
        now = _work_without_memory(child)
        if now is None or began is None:  # it still gets what it asks for
            began = now
        elif now[1] - began[1] > max(_HANG, now[0] - began[0]):
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return -signal.SIGKILL, "a library that asked for memory for ever"


def _work_without_memory(child: int) -> tuple[float, float] | None:
    """Processor times of a process itself and in the system [s]; None where it has memory left."""
    try:
        with open(f"/proc/{child}/statm", encoding="ascii") as file:
            taken = int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        with open(f"/proc/{child}/stat", encoding="ascii") as file:
            ticks = file.read().rpartition(")")[2].split()[11:13]
    except (OSError, ValueError, IndexError):
        return None
    user, system = (int(count) / os.sysconf("SC_CLK_TCK") for count in ticks)
    return (user, system) if address_limit() - taken < _BUFFER else None
