"""What differs between operating systems. No other module asks which one it is, or names what only some have.

Where a system lacks something, the way that all have is taken, or nothing happens, as each function says.
"""

import contextlib
import ctypes
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

TEMPORARY = "/tmp"  # nosec B108  # of systems that name no folder; names in it are random
SYSTEM_FOLDERS = ("/dev", "/proc", "/sys")  # devices and processes
SHARED_MEMORY = "/dev/shm/"  # nosec B108  # memory that is used like a disk
PIPES = "/dev/fd"  # where open files have names
LOCK = ".lock"  # in a folder that is locked
_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG
_LOOK_S = 0.5  # between two looks at another process


def module(name: str) -> Any:
    """A module of the standard library that some systems lack; None there."""
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError:
        return None


@contextlib.contextmanager
def locked(folder: Path, name: str = LOCK) -> Iterator[None]:
    """Wait until no other thread or process is in such a block with the same folder, which is there, and name.

    File systems that cannot lock, and folders that cannot be written, run the block at once.
    """
    from filelock import FileLock

    lock = FileLock(folder / name)
    with contextlib.suppress(OSError, NotImplementedError):
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def processors() -> list[int]:
    """Numbers of the processors that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return sorted(affinity(0)) if affinity else list(range(os.cpu_count() or 1))


def use_processors(numbers: Iterable[int]) -> None:
    """Bind this thread, and so the processes that it starts, to some processors; nothing where that cannot be done."""
    bind = getattr(os, "sched_setaffinity", None)
    if bind:
        bind(0, numbers)


def runs(process: int) -> bool:
    """Whether a process of this machine runs."""
    import psutil

    try:
        return bool(psutil.pid_exists(process))
    except OverflowError:
        return True


def owner() -> int | None:
    """The number of this user; None where files have no owners."""
    number = getattr(os, "geteuid", None)
    return None if number is None else int(number())


def peak_memory() -> float:
    """Peak memory of this process [bytes]."""
    resource = module("resource")
    if resource is not None:
        return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * (1.0 if sys.platform == "darwin" else 1024.0)
    import psutil

    return float(getattr(psutil.Process().memory_info(), "peak_wset", float("nan")))


def return_freed_memory() -> None:
    """Return freed memory to the system: glibc keeps arrays of up to 32 MB for the thread that asked for them."""
    with contextlib.suppress(AttributeError, OSError, TypeError):  # another library of C has no such function
        ctypes.CDLL(None).malloc_trim(0)


def free_memory() -> float:
    """Memory of this machine that can be taken without swapping [bytes]."""
    import psutil

    return float(psutil.virtual_memory().available)


def address_limit() -> float:
    """The limit of this process's address space (`ulimit -v`) [bytes]; infinite where there is none."""
    resource = module("resource")
    if resource is None:
        return float("inf")
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return float("inf") if limit == resource.RLIM_INFINITY else float(limit)


def end_with_parent() -> None:
    """Let this process end when its parent is killed, which could not end it any more."""
    parent = os.getppid()
    with contextlib.suppress(AttributeError, OSError, TypeError):
        if ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, 9) == 0:
            return

    def look() -> None:
        while os.getppid() == parent and runs(parent):
            time.sleep(_LOOK_S)
        os._exit(1)

    threading.Thread(target=look, daemon=True).start()


class TimeExceeded(Exception):
    """A process has used all of its time.

    Attributes:
        processor: Whether it was the processor time; else the time by the clock.
    """

    def __init__(self, processor: bool):
        super().__init__("out of processor time" if processor else "out of time")
        self.processor = processor


def run_limited(command: list[str], folder: Path, processor_s: float, clock_s: float) -> tuple[int, bytes]:
    """Exit status and standard error of a process.

    Args:
        command: Of the process, which reads nothing; its output is not kept.
        processor_s, clock_s: Time after which it is ended [s].

    Raises:
        TimeExceeded: It was.
    """
    import psutil

    begin = time.monotonic()
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, cwd=folder
    ) as process:
        try:
            while True:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    _, messages = process.communicate(timeout=_LOOK_S)
                    return process.returncode, messages
                with contextlib.suppress(psutil.Error):
                    used = psutil.Process(process.pid).cpu_times()
                    if used.user + used.system > processor_s:
                        raise TimeExceeded(True)
                if time.monotonic() - begin > clock_s:
                    raise TimeExceeded(False)
        except BaseException:
            process.kill()
            raise
