"""Several processes at once."""

import random

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
