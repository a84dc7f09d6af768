"""Several processes at once, and clocks that jump."""

from __future__ import annotations

import os
import random
import time
from collections.abc import Callable

import runs
import verdicts
from workspace import Workspace

TOGETHER = 8


def together(space: Workspace, rng: random.Random, count: int, tally: verdicts.Tally) -> None:
    """Eight processes with one cache and one output, each of which lacks a part of the cache."""
    for number in range(count):
        space.reset(old_outputs=rng.random() < 0.3)
        parts = {space.cool(rng) for _ in range(3)}
        about = f"together {number}, without {', '.join(sorted(parts))}"
        started = [runs.start(space, space.arguments(False)) for _ in range(TOGETHER)]
        endings = [run.wait(TOGETHER * runs.LIMIT) for run in started]
        for ending in endings:
            faults = [] if ending.status == 0 else [f"exit status {ending.status}", *verdicts.refusal_faults(ending)]
            tally.add("same result" if ending.status == 0 else "other", about, faults)
        faults = [*verdicts.result_faults(space, False), *verdicts.leftovers(space)]
        tally.runs += 1
        tally.add("sets of files compared", about, faults)


def clocks(space: Workspace, rng: random.Random, count: int, tally: verdicts.Tally) -> None:
    """A clock that jumps by up to a century, in both directions, and files from the future."""
    for number in range(count):
        space.reset(old_outputs=rng.random() < 0.3)
        about = f"clock {number}, without {space.cool(rng)}"
        for path in space.cache.rglob("*"):
            if rng.random() < 0.5:
                when = time.time() + rng.choice((-1, 1)) * 10.0 ** rng.uniform(0.0, 9.0)
                os.utime(path, (max(when, 0.0), max(when, 0.0)))
        ending = runs.run(space, fault=jumps(rng.randrange(2**31)))
        faults = [f"exit status {ending.status}", *verdicts.refusal_faults(ending)]
        if ending.status == 0:
            faults = [*verdicts.result_faults(space, False), *verdicts.leftovers(space)]
        tally.runs += 1
        tally.add("same result" if ending.status == 0 else "other", about, faults)


def jumps(seed: int) -> Callable[[], None]:
    """A fault that lets the wall clock jump at a hundredth of its readings, and the others stand still at some."""

    def install() -> None:
        rng, shift, stop = random.Random(seed), [0.0], [0.0]
        wall, steady = time.time, time.perf_counter

        def jumping() -> float:
            if rng.random() < 0.01:
                shift[0] += rng.choice((-1, 1)) * 10.0 ** rng.uniform(0.0, 9.0)
            return wall() + shift[0]

        def stopping() -> float:
            if rng.random() < 0.9:
                stop[0] = steady()
            return stop[0]

        time.time, time.perf_counter, time.monotonic = jumping, stopping, stopping

    return install
