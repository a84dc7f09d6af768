"""Whether a process gets anywhere, however slow the machine is: what it does is measured in processor time."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

IDLE = 1.0  # less processor time [s] than a run takes in that time, but where it waits for a processor all the time


@dataclass
class Watch:
    """A session of processes that may get stuck.

    Attributes:
        session: Number of its first process.
        limit: More processor time [s] than it may take, or none in as much time by the clock, and it is stuck.
    """

    session: int
    limit: float
    _looked: float = field(init=False, default_factory=time.monotonic)
    _first: float = field(init=False)
    _before: float = field(init=False)

    def __post_init__(self) -> None:
        self._first = self._before = work(self.session)[0]

    def stuck(self) -> bool:
        """Whether it is stuck; to be asked again and again."""
        if time.monotonic() - self._looked < self.limit:
            return False
        self._looked, (used, ready) = time.monotonic(), work(self.session)
        idle, self._before = used - self._before < IDLE and not ready, used
        return idle or used - self._first > self.limit


def work(session: int) -> tuple[float, bool]:
    """Processor time of the processes of a session and of those that they have awaited [s], and whether one of them
    works or waits for a processor: many programs may share the machine, and this one be the least of them."""
    ticks, ready = 0, False
    for file in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError, ValueError, IndexError):  # it has ended
            fields = file.read_text().rpartition(")")[2].split()
            if int(fields[3]) == session:
                ticks += sum(map(int, fields[11:15]))
                ready = ready or fields[0] == "R"
    return ticks / os.sysconf("SC_CLK_TCK"), ready
