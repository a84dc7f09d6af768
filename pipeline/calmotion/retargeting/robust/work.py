"""The work of a search."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass
class Work:
    """What was done to find the curves.

    Attributes:
        evaluations, linearizations: Of all robots.
        sweeps: Linearised sweeps whose cost the responses of a robot had.
        wall_s, processor_s: Time [s].
    """

    evaluations: int = 0
    linearizations: int = 0
    sweeps: int = 0
    wall_s: float = 0.0
    processor_s: float = 0.0

    @contextmanager
    def timed(self) -> Iterator[None]:
        """Add the time that something takes."""
        begin, processor = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.wall_s += time.perf_counter() - begin
            self.processor_s += time.process_time() - processor
