"""The tables of a campaign, for the terminal and docs/reliability.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import verdicts

BEGIN, END = "<!-- counts of make torture -->", "<!-- end of the counts -->"


def text(tallies: Mapping[str, verdicts.Tally], where: Counter[str], about: str) -> str:
    """The counts of a campaign as Markdown.

    Args:
        tallies: By kind of fault.
        where: Numbers of kills: `stage<tab>name<tab>signal` and `write<tab>label`.
        about: When and on what it ran, a sentence.
    """
    rows = [
        [
            kind,
            str(tally.runs),
            ", ".join(f"{outcome} {count}" for outcome, count in sorted(tally.counts.items(), key=_by_count)),
            str(len(tally.faults)),
        ]
        for kind, tally in tallies.items()
    ]
    parts = [
        f"{about} A fault is a result that is lost or differs, a half-written or left file, a traceback, a crash, "
        "or a run that does not end.",
        _table(["disturbance", "runs", "outcomes, also of the next runs", "faults"], rows),
    ]
    if where:
        parts += ["Kills by stage and signal:", _by_stage(where), "Kills just before a write:", _by_write(where)]
    faults = [f"- {kind}, {fault}" for kind, tally in tallies.items() for fault in tally.faults]
    return "\n\n".join([*parts, *(["Faults:", "\n".join(faults)] if faults else [])])


def insert(path: Path, table: str) -> None:
    """Replace the counts of a document, between its two marks."""
    before, _, rest = path.read_text().partition(BEGIN)
    path.write_text(f"{before}{BEGIN}\n\n{table}\n\n{END}{rest.partition(END)[2]}")


def _by_count(item: tuple[str, int]) -> int:
    return -item[1]


def _by_stage(where: Counter[str]) -> str:
    cells = {tuple(name.split("\t")[1:]): count for name, count in where.items() if name.startswith("stage\t")}
    stages = sorted({stage for stage, _ in cells})
    sums = Counter[str]()
    for (_, name), count in cells.items():
        sums[name] += count
    signals = [name for name, _ in sums.most_common()]
    rows = [[stage, *(str(cells.get((stage, name), 0)) for name in signals)] for stage in stages]
    return _table(["stage", *(name.removeprefix("SIG") for name in signals)], rows)


def _by_write(where: Counter[str]) -> str:
    counts: dict[str, dict[str, int]] = {}
    for name, count in where.items():
        if name.startswith("write\t"):
            kind, _, how = name.split("\t")[1].partition(": ")
            counts.setdefault(kind, {})[how] = count
    rows = [
        [kind, str(sum(row.values())), ", ".join(f"{how} {n}" for how, n in sorted(row.items()))]
        for kind, row in sorted(counts.items())
    ]
    return _table(["file", "kills", "before"], rows)


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
