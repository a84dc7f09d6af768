"""Signals that end a run, and streams that are closed: a farm's SIGTERM and a terminal's SIGHUP do what Ctrl-C does."""

import io
import os
import signal
import stat
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from calmotion.support import interrupts

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # the last one on Windows alone
_DEFAULTS = (signal.SIG_DFL, signal.default_int_handler)


@contextmanager
def as_interrupts(ends: bool = False) -> Iterator[None]:
    """Raise KeyboardInterrupt on the signals that ask a process to end, so that the best result so far is written.

    A signal that the caller ignores (`nohup`) or handles already is left alone. An interrupt that Python cannot raise,
    such as in a callback of a weak reference, is raised at the next step of the host.

    Args:
        ends: Whether the process ends afterwards: what was handled is ignored then, so that a signal does not take its
            exit status, when all is written.
    """
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():  # elsewhere Python sets no handlers
        for number in (getattr(signal, name) for name in _NAMES if hasattr(signal, name)):
            if signal.getsignal(number) in _DEFAULTS:
                before[number] = signal.signal(number, _interrupt)
    hook, sys.unraisablehook = sys.unraisablehook, _without_interrupts(sys.unraisablehook)
    interrupts.answer()  # of an earlier run in this process
    try:
        yield
    finally:
        interrupts.answer()
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if ends else handler)


def ignore() -> None:
    """Ignore further signals, until `as_interrupts` ends: the process is about to do so."""
    for number in (getattr(signal, name) for name in _NAMES if hasattr(signal, name)):
        if signal.getsignal(number) is _interrupt:
            signal.signal(number, signal.SIG_IGN)


def _interrupt(number: int, frame: Any) -> None:
    if number == getattr(signal, "SIGHUP", None):
        _leave_terminal()
    interrupts.request()


def _without_interrupts(hook: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A hook for exceptions that cannot be raised, which prints no interrupts: those are raised later."""

    def unraisable(found: Any) -> None:
        if not issubclass(found.exc_type, KeyboardInterrupt):
            hook(found)

    return unraisable


def _leave_terminal() -> None:
    """Print to nowhere from now on: writing to a terminal that is closed fails, and would end the run."""
    for descriptor in (1, 2):
        with suppress(OSError):
            if stat.S_ISCHR(os.fstat(descriptor).st_mode):  # a terminal; a closed one is no tty any more
                _to_nowhere(descriptor)


def _to_nowhere(descriptor: int) -> None:
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)


def prepare_streams() -> None:
    """Open standard streams that are closed on the null device, and let all replace characters that they do not have.

    Python has None for closed ones, and the next file that is opened gets the number of the stream: what a library
    prints would go into that file.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number
    for name, number in (("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w", encoding="utf-8", errors="replace", closefd=False))
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def flushed(told: bool) -> bool:
    """Write what is left for standard output, and tell whether it takes that; if not, it prints to nowhere from now on,
    since Python would try again at its exit, and end with a message and a status of its own.

    Args:
        told: Whether the user knows already that something is wrong.
    """
    try:
        sys.stdout.flush()
    except OSError as error:
        if not told and not isinstance(error, BrokenPipeError):
            print(f"error: the output cannot be written: {error.strerror}", file=sys.stderr)
        _to_nowhere(1)
        return False
    return True
