"""A process that runs the command line for a worker, and ends when the worker does.

The worker holds the other end of its standard input: where that is closed, the worker is gone, and a run that another
worker has taken over must write nothing any more.
"""

import os
import runpy
import sys
import threading

ORPHANED = 137  # exit status of a process whose worker is gone, as of one that was killed


def main() -> None:
    """Run `calmotion` with the arguments of this process."""
    watched = os.dup(0)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    threading.Thread(target=_end_with_worker, args=(watched,), daemon=True).start()
    sys.argv[0] = "calmotion"
    runpy.run_module("calmotion", run_name="__main__", alter_sys=True)


def _end_with_worker(watched: int) -> None:
    while os.read(watched, 4096):
        pass
    os._exit(ORPHANED)


if __name__ == "__main__":
    main()
