"""Signals that end a run."""

import signal
import threading

import pytest
from calmotion.cli.signals import as_interrupts

NUMBERS = [signal.SIGTERM, signal.SIGHUP]


@pytest.mark.parametrize("number", NUMBERS)
def test_a_signal_is_an_interrupt_inside_and_what_it_was_outside(number):
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), as_interrupts():
        signal.raise_signal(number)
    assert signal.getsignal(number) is before is signal.SIG_DFL


@pytest.mark.parametrize("handler", [signal.SIG_IGN, lambda number, frame: None])
def test_a_signal_that_the_caller_handles_is_left_alone(handler):
    before = signal.signal(signal.SIGHUP, handler)
    try:
        with as_interrupts():
            assert signal.getsignal(signal.SIGHUP) is handler
            signal.raise_signal(signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)


def test_other_threads_set_no_handlers():
    errors = []

    def run():
        try:
            with as_interrupts():
                errors.append(signal.getsignal(signal.SIGTERM))
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert errors == [signal.SIG_DFL]
