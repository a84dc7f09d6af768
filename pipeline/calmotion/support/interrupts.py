"""Interrupts that are lost: code that swallows KeyboardInterrupt does not make a run go on.

Weak references, imports and native libraries may discard an exception that a signal raises in them, or make another one
of it. The handler of the signal therefore also sets a request, which stands until the interrupt is answered; the host
checks it between its steps.
"""

from collections.abc import Iterator
from contextlib import contextmanager


class _State:
    pending = False
    deferred = False


_STATE = _State()


def request() -> None:
    """Interrupt the run; called by the handler of a signal.

    Raises:
        KeyboardInterrupt: Always, except for a first request inside `deferred`.
    """
    again, _STATE.pending = _STATE.pending, True
    if again or not _STATE.deferred:
        raise KeyboardInterrupt


def check() -> None:
    """Raise an interrupt that was requested and not answered.

    Raises:
        KeyboardInterrupt: There is one.
    """
    if _STATE.pending:
        raise KeyboardInterrupt


def answer() -> None:
    """Say that the interrupt was received; whoever catches KeyboardInterrupt and goes on calls this."""
    _STATE.pending = False


@contextmanager
def deferred() -> Iterator[None]:
    """Let code that an interrupt would leave half done end first; a second interrupt ends it all the same.

    Raises:
        KeyboardInterrupt: One was requested meanwhile.
    """
    outer, _STATE.deferred = _STATE.deferred, True
    try:
        yield
    finally:
        _STATE.deferred = outer
    if not outer:
        check()
