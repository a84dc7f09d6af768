"""The program `calmotion`, also by `python -m calmotion`."""

import atexit
import os
import signal
import sys

INTERRUPTED = 130


def main() -> int:
    """Run the command line; an interrupt while it is imported ends as a later one does."""
    try:
        from calmotion.cli.main import main as run

        status = run()
    except KeyboardInterrupt:
        status = INTERRUPTED
        print("error: interrupted", file=sys.stderr)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # nothing is left to interrupt
    if status == INTERRUPTED:
        _leave(status)
    return status


def _leave(status: int) -> None:
    """End the process with a status.

    Where an interrupt passed through `exec`, Python would end by a signal in place of the status, though it was caught.
    """
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):  # closed
            pass
    os._exit(status)


if __name__ == "__main__":
    sys.exit(main())
