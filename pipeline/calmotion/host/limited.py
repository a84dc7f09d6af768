"""Carrying out a call that must end in time."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from typing import TypeVar

from calmotion.host.errors import PluginError

T = TypeVar("T")
_TICK = 0.1  # between two looks, so that an interrupt is noticed [s]


class _Overdue(BaseException):
    """Raised inside a call that takes too long; no plugin catches it by accident."""


def call_within(limit: float, call: Callable[[], T], name: str) -> T:
    """What a call returns, in a thread of its own.

    A call that is still running when its time is over is asked to end at its next step in Python, and is left behind in
    any case: a plugin that hangs in a library never takes the host with it.

    Args:
        limit: [s].
        call: What to do.
        name: Operator, for the message.

    Raises:
        PluginError: It took longer.
        BaseException: What the call raises.
    """
    outcome: list[T] = []
    failure: list[BaseException] = []

    def work() -> None:
        try:
            outcome.append(call())
        except _Overdue:
            pass
        except BaseException as error:
            failure.append(error)

    thread = threading.Thread(target=work, name=name, daemon=True)
    thread.start()
    left = limit
    try:
        while thread.is_alive() and left > 0.0:
            thread.join(min(_TICK, left))
            left -= _TICK
    except KeyboardInterrupt:
        _end(thread, KeyboardInterrupt)
        thread.join(_TICK)
        raise
    if thread.is_alive():
        _end(thread, _Overdue)
        raise PluginError(
            f"the operator {name} did not end within {limit:g} s",
            path=f"{name}.timeout",
            found="it was still running",
            remedy=f"Allow it more time (--set {name}.timeout=60s), disable its plugin (calmotion plugins disable), or "
            "tell its maintainer",
        )
    if failure:
        raise failure[0]
    return outcome[0]


def _end(thread: threading.Thread, kind: type[BaseException]) -> None:
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident or 0), ctypes.py_object(kind))
