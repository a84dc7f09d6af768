"""What a run must leave: the same result, a clear refusal, or an interrupted one; and no file that stays for ever."""

import csv
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from runs import Ending
from workspace import FIGURES, OUTPUTS, Workspace

_NUMBER = re.compile(r"(?<![\w/\"])-?\d+\.?\d*(?:e[-+]?\d+)?(?![\w\"])")
SAME = 1e-6  # largest relative difference of two numbers of the same result


@dataclass
class Tally:
    """Counts of one kind of fault.

    Attributes:
        counts: By outcome.
        faults: Descriptions of what must not happen.
        runs: How many runs were disturbed; the runs after them, which nothing disturbs, are not in it.
    """

    counts: dict[str, int] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    runs: int = 0

    def add(self, outcome: str, about: str = "", faults: Iterable[str] = ()) -> None:
        """Count an outcome, and tell the faults that were found with it."""
        self.counts[outcome] = self.counts.get(outcome, 0) + 1
        found = [f"{about}: {fault}" for fault in faults]
        self.faults += found
        if found:
            print(*found, sep="\n", flush=True)


def refusal_faults(ending: Ending) -> list[str]:
    """What is wrong with a run that did not end with a result."""
    faults = []
    if ending.status is None:
        return ["stuck"]
    if "Traceback" in ending.err or "Traceback" in ending.out:
        faults.append(f"a traceback: {_last(ending)}")
    if "panicked" in ending.err:
        faults.append(f"a panic: {_last(ending)}")
    if ending.status < 0:
        faults.append(f"ended by signal {-ending.status}: {_last(ending)}")
    elif ending.status not in (1, 2, 130):
        faults.append(f"exit status {ending.status}: {_last(ending)}")
    elif ending.status != 130 and '"error"' not in ending.out and "error:" not in ending.err:
        faults.append(f"exit status {ending.status} without an error")
    return faults


def result_faults(space: Workspace, figures: bool) -> list[str]:
    """How the outputs differ from those of an undisturbed run."""
    faults = []
    for name in (*OUTPUTS, *(FIGURES if figures else ())):
        found, expected = space.out / name, space.expected / name
        if not found.is_file():
            faults.append(f"{name} is lost")
        elif not complete(found):
            faults.append(f"{name} is half written")
        elif found.suffix == ".usda" and not same_text(found.read_text(), expected.read_text()):
            faults.append(f"{name} differs")
        elif found.suffix == ".csv" and not same_table(found, expected):
            faults.append(f"{name} differs")
    return faults


def unfinished_faults(space: Workspace) -> list[str]:
    """Outputs of a run that did not end which are neither absent nor whole."""
    return [f"{path.name} is half written" for path in space.out.iterdir() if path.suffix and not complete(path)]


def leftovers(space: Workspace) -> list[str]:
    """Files after a whole run that nothing uses or removes."""
    used = {f"out/{name}" for name in (*OUTPUTS, *FIGURES)}
    used |= {f"cache/{path.relative_to(space.warm)}" for path in space.warm.rglob("*")}
    left = (name for name in space.files() - used if not name.startswith("cache/kernels/") or "/.calmotion-" in name)
    return [f"{name} is left" for name in sorted(left)]


def complete(path: Path) -> bool:
    """Whether a file has its end; True for what is not an output, such as a temporary file."""
    if path.name.startswith("."):
        return True
    data = path.read_bytes()
    if path.suffix == ".usda":
        return (
            data.startswith(b"#usda") and data.rstrip().endswith((b"}", b")")) and data.count(b"{") == data.count(b"}")
        )
    if path.suffix == ".csv":
        rows = list(csv.reader(data.decode().splitlines()))
        return len(rows) > 2 and data.endswith(b"\n") and all(len(row) == len(rows[0]) for row in rows)
    if path.suffix == ".png":
        return data.startswith(b"\x89PNG") and data.endswith(b"IEND\xaeB`\x82")
    return data.startswith(b"RRF2") and len(data) > 10000 if path.suffix == ".rrd" else True


def same_text(found: str, expected: str) -> bool:
    """Whether two layers have the same words and, within `SAME`, the same numbers."""
    if _NUMBER.sub("#", found) != _NUMBER.sub("#", expected):
        return False
    pairs = zip(map(float, _NUMBER.findall(found)), map(float, _NUMBER.findall(expected)), strict=True)
    return all(abs(a - b) <= SAME * max(abs(a), abs(b)) + 1e-9 for a, b in pairs)


def same_table(found: Path, expected: Path) -> bool:
    """Whether two tables agree within `SAME` of the largest number of each column."""
    tables = [list(csv.reader(path.read_text().splitlines())) for path in (found, expected)]
    if tables[0][0] != tables[1][0] or len(tables[0]) != len(tables[1]):
        return False
    columns = [list(zip(*([float(value) for value in row] for row in table[1:]), strict=True)) for table in tables]
    return all(
        max(abs(a - b) for a, b in zip(one, other, strict=True)) <= SAME * max(map(abs, other)) + 1e-12
        for one, other in zip(*columns, strict=True)
    )


def _last(ending: Ending) -> str:
    lines = [line for line in ending.text.splitlines() if line.strip()]
    return " / ".join(lines[-6:])[-600:]
