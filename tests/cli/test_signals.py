"""Signals that end a run."""

import signal
import subprocess
import sys
import threading

import pytest
from calmotion.cli.signals import as_interrupts, ignore
from calmotion.support import interrupts

pytestmark = pytest.mark.posix
NUMBERS = [signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)]


@pytest.fixture(autouse=True)
def default_handlers():
    """The handlers of a process that nobody started with `nohup`, which leaves SIGHUP ignored in all its children."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in NUMBERS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def test_an_interrupt_in_a_callback_that_cannot_raise_is_raised_by_the_next_check(capfd):
    class Noisy:
        def __del__(self):
            signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt), as_interrupts():
        noisy = Noisy()
        del noisy
        interrupts.check()
    assert capfd.readouterr().err == ""


def test_signals_are_ignored_at_the_end():
    before = signal.getsignal(signal.SIGTERM)
    with as_interrupts():
        ignore()
        signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.parametrize("number", NUMBERS)
def test_a_signal_is_an_interrupt_inside_and_what_it_was_outside(number):
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), as_interrupts():
        signal.raise_signal(number)
    assert signal.getsignal(number) is before is signal.SIG_DFL


@pytest.mark.parametrize("number", NUMBERS)
def test_a_signal_after_the_last_command_of_a_process_is_ignored(number):
    with as_interrupts(ends=True):
        pass
    signal.raise_signal(number)
    assert signal.getsignal(number) is signal.SIG_IGN


@pytest.mark.parametrize("number", NUMBERS)
def test_a_signal_at_the_end_of_the_process_does_not_take_its_status(number):
    code = f"""import atexit, signal, sys
from calmotion.__main__ import main
signal.signal({int(number)}, signal.SIG_DFL)
atexit.register(signal.raise_signal, {int(number)})
sys.exit(main())"""
    for arguments, status in ((["--version"], 0), ([], 2)):
        done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True)
        assert done.returncode == status, done.stderr


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
