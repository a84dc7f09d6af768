"""Random kills: every signal, at a random moment or just before a random write of a random kind.

A series kills the same command up to four times, each time with a part of the caches missing, and then lets it end.
"""

import itertools
import os
import random
import signal
import time
from collections import Counter
from functools import cache
from pathlib import Path

import events
import runs
import verdicts
from workspace import Workspace

ASKING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # those that the program answers
FATAL = (signal.SIGQUIT, signal.SIGABRT, signal.SIGSEGV, signal.SIGBUS, signal.SIGALRM, signal.SIGUSR1, signal.SIGXCPU)
COLD = 0.05  # share of runs in a new process, which can be killed while it imports
TRIED, KERNELS = 40, 4  # kernels that are tried, and most that are taken away, one at a time
CACHED = ("kernels", "meshes", "reductions")


class Writes:
    """The writes that an undisturbed run does, found by running it."""

    def __init__(self, space: Workspace) -> None:
        file = space.root / "events"
        self.counts: Counter[str] = Counter()
        rng = random.Random(1)
        space.reset()
        self._record(space, file, figures=True)
        for part in CACHED:
            if part == "kernels":
                names = space.kernel_names()
                rng.shuffle(names)
                again = (name for name in names[:TRIED] if self._makes_again(space, file, name))
                space.kernels[:] = list(itertools.islice(again, KERNELS))
            else:
                space.reset()
                space.cool(rng, part)
                self._record(space, file)

    def _makes_again(self, space: Workspace, file: Path, kernel: str) -> bool:
        """Whether a run compiles a kernel that is missing: not one that is compiled into those that call it."""
        space.reset()
        space.remove_kernel(kernel)
        return "kernels: rename" in self._record(space, file)

    def _record(self, space: Workspace, file: Path, figures: bool = False) -> Counter[str]:
        """Take in the writes of a run."""
        ending = runs.run(space, figures, fault=events.record(space, file))
        assert ending.status == 0, ending.err
        found = Counter(file.read_text().split("\n"))
        file.unlink()
        del found[""]
        self.counts |= found
        return found

    def draw(self, rng: random.Random) -> tuple[str, int]:
        """A kind of write and which one of a run: all kinds alike, however often a run does them."""
        name = rng.choice(sorted(self.counts))
        return name, rng.randint(1, self.counts[name])


@cache
def writes_of(space: Workspace) -> Writes:
    """The writes of a workspace, found once."""
    return Writes(space)


def draw_signal(rng: random.Random) -> int:
    """A signal: half of them SIGKILL, a third those that the program answers."""
    share = rng.random()
    return signal.SIGKILL if share < 0.5 else rng.choice(ASKING) if share < 0.85 else rng.choice(FATAL)


def campaign(space: Workspace, rng: random.Random, kills: int, tally: verdicts.Tally, seconds: float) -> None:
    """Kill runs.

    Args:
        kills: How many more; the last series goes on to its end.
        tally: Takes the outcomes.
        seconds: Processor time of an undisturbed run [s].
    """
    writes = writes_of(space)
    enough = tally.runs + kills
    while tally.runs < enough:
        space.reset(old_outputs=rng.random() < 0.3)
        figures = rng.random() < 0.15
        about = f"series at kill {tally.runs}"
        for _ in range(rng.randint(1, 4)):
            cooled = space.cool(rng)
            parts = {cooled, "layer", "root layer", "table", "recording", "checkpoint", "temporary files"}
            parts |= {"figures"} if figures else set()
            name, count = writes.draw(rng)
            while name.split(":")[0] not in parts:
                name, count = writes.draw(rng)
            number = draw_signal(rng)
            timed = rng.random() < 0.4
            if timed:
                cold = rng.random() < COLD / 0.4
                run = runs.start(space, space.arguments(figures), cold=cold)
                run.wait_for(rng.uniform(0.0, (4.0 if figures else 1.0) * (4.0 if cold else 1.1) * seconds))
                time.sleep(rng.uniform(0.0, 0.02))  # also where the run waits
                run.send(number)
                ending = run.wait()
            else:
                cold, limit = False, number
                fault = events.strike(space, name, count, lambda limit=limit: os.kill(os.getpid(), limit))
                ending = runs.run(space, figures, fault)
            tally.runs += 1
            text = f"{about}, {signal.Signals(number).name} {'at a moment' if timed else f'at {name} {count}'}"
            _judge(space, ending, number, cold, text, tally)
            if ending.status == 0:
                break
        ending = runs.run(space, figures)
        faults = [f"the next run: exit status {ending.status}", *verdicts.refusal_faults(ending)]
        if ending.status == 0:
            faults = [*verdicts.result_faults(space, figures), *verdicts.leftovers(space)]
        tally.add("finished by the next run", f"{about}, {text}", faults)


def _judge(space: Workspace, ending: runs.Ending, number: int, cold: bool, text: str, tally: verdicts.Tally) -> None:
    """Count how a killed run ended."""
    faults = verdicts.unfinished_faults(space)
    if ending.status == 0:
        tally.add("ended before the signal", text, faults)
    elif ending.status == -number and (number not in ASKING or (cold and not ending.err)):
        tally.add("killed", text, faults)
    elif ending.status == 130:
        tally.add("exit status 130", text, faults + verdicts.refusal_faults(ending))
    else:
        faults += verdicts.refusal_faults(ending)
        tally.add("other", text, faults or [f"exit status {ending.status}"])
