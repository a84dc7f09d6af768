"""Whether a process gets anywhere, however slow the machine is: what it does is measured in processor time."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

IDLE = 1.0  # less time [s] in which a thread works or waits for a processor than any run has between two looks


@dataclass
class Watch:
    """A session of processes that may get stuck.

    Attributes:
        session: Number of its first process.
        limit: More processor time [s] than it may take; it is also stuck when no thread of it works, or waits for a
            processor, for as long by the clock.
    """

    session: int
    limit: float
    _looked: float = field(init=False, default_factory=time.monotonic)
    _first: float = field(init=False)
    _before: float = field(init=False)
    _threads: dict[str, float] = field(init=False)

    def __post_init__(self) -> None:
        self._first = self._before = work(self.session)
        self._threads = _wanted(self.session)

    def stuck(self) -> bool:
        """Whether it is stuck; to be asked again and again."""
        if time.monotonic() - self._looked < self.limit:
            return False
        used, threads = work(self.session), _wanted(self.session)
        grown = [used - self._before, *(time - self._threads.get(name, 0.0) for name, time in threads.items())]
        self._looked, self._before, self._threads = time.monotonic(), used, threads
        return max(grown) < IDLE and not _waits(self.session) or used - self._first > self.limit


def work(session: int) -> float:
    """Processor time of the processes of a session and of those that they have awaited [s]."""
    return sum(sum(map(int, fields[11:15])) for _, fields in _processes(session)) / os.sysconf("SC_CLK_TCK")


def _wanted(session: int) -> dict[str, float]:
    """Time in which each thread of a session worked or waited for a processor [s]: many programs may share the machine,
    and this one be the least of them."""
    found = {}
    for process, _ in _processes(session):
        for file in process.glob("task/*/schedstat"):
            with suppress(OSError, ValueError):  # it has ended
                found[file.parent.name] = 1e-9 * sum(map(int, file.read_text().split()[:2]))
    return found


def _waits(session: int) -> bool:
    """Whether a thread of a session works or waits for a processor now: how long is counted when it gets one."""
    for process, _ in _processes(session):
        for file in process.glob("task/*/stat"):
            with suppress(OSError):  # it has ended
                if file.read_text().rpartition(")")[2].split()[:1] == ["R"]:
                    return True
    return False


def _processes(session: int) -> Iterator[tuple[Path, list[str]]]:
    """Folders and states of the processes of a session, see `man 5 proc`, from the third field on."""
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError, ValueError, IndexError):  # it has ended
            fields = (process / "stat").read_text().rpartition(")")[2].split()
            if int(fields[3]) == session:
                yield process, fields
