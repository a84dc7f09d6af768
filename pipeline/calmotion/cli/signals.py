"""Signals that end a run: a farm's SIGTERM and a closed terminal's SIGHUP do what Ctrl-C does."""

from __future__ import annotations

import os
import signal
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

_NAMES = ("SIGTERM", "SIGHUP", "SIGBREAK")  # the last one on Windows alone


@contextmanager
def as_interrupts() -> Iterator[None]:
    """Raise KeyboardInterrupt on the signals that ask a process to end, so that the best result so far is written.

    A signal that the caller ignores (`nohup`) or handles already is left alone.
    """
    changed = []
    if threading.current_thread() is threading.main_thread():  # elsewhere Python sets no handlers
        for number in (getattr(signal, name) for name in _NAMES if hasattr(signal, name)):
            if signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, _interrupt)
                changed.append(number)
    try:
        yield
    finally:
        for number in changed:
            signal.signal(number, signal.SIG_DFL)


def _interrupt(number: int, frame: Any) -> None:
    if number == getattr(signal, "SIGHUP", None):
        _leave_terminal()
    raise KeyboardInterrupt


def _leave_terminal() -> None:
    """Print to nowhere from now on: writing to a terminal that is closed fails, and would end the run."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in (1, 2):
        with suppress(OSError):
            if stat.S_ISCHR(os.fstat(descriptor).st_mode):  # a terminal; a closed one is no tty any more
                os.dup2(nowhere, descriptor)
    os.close(nowhere)
