"""What a campaign has counted, in a file that later campaigns add to: `tests/torture/counts.json`.

A campaign of hours is stopped and goes on, so each piece of it is kept as soon as it has ended, by the commit that ran.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections import Counter
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import verdicts
from workspace import HERE, REPOSITORY

PATH = HERE / "counts.json"


@dataclass
class Record:
    """Counts by commit, and within it by the kind of fault.

    Attributes:
        entries: Rows of the file: `commit`, `date`, `kind`, `runs`, `counts`, `where` and `faults`.
        path: Its file; None keeps nothing.
    """

    entries: list[dict] = field(default_factory=list)
    path: Path | None = None

    @staticmethod
    def read(path: Path | None) -> Record:
        """The record of a file; an empty one when there is no such file."""
        text = path.read_text() if path is not None and path.is_file() else "[]"
        return Record(json.loads(text), path)

    def runs(self, kind: str) -> int:
        """How many runs were disturbed by a kind of fault."""
        return sum(entry["runs"] for entry in self.entries if entry["kind"] == kind)

    def add(self, kind: str, tally: verdicts.Tally, where: Counter[str]) -> None:
        """Add what a piece of a campaign has counted, and write the file."""
        commit, date = _commit(), f"{datetime.now(UTC):%Y-%m-%d}"
        empty = {"commit": commit, "kind": kind, "date": date, "runs": 0, "counts": {}, "where": {}, "faults": []}
        entry = next((old for old in self.entries if (old["commit"], old["kind"]) == (commit, kind)), None)
        if entry is None:
            entry = empty
            self.entries.append(entry)
        entry["runs"] += tally.runs
        entry["counts"] = dict(Counter(entry["counts"]) + Counter(tally.counts))
        entry["where"] = dict(sorted((Counter(entry["where"]) + where).items()))
        entry["faults"] += tally.faults
        if self.path is not None:
            temporary = self.path.with_suffix(".part")
            temporary.write_text(json.dumps(self.entries, indent=1) + "\n")
            os.replace(temporary, self.path)

    def sums(self) -> tuple[dict[str, verdicts.Tally], Counter[str]]:
        """Counts by the kind of fault, and the kills by where they were, of all commits."""
        tallies: dict[str, verdicts.Tally] = {}
        where: Counter[str] = Counter()
        for entry in self.entries:
            tally = tallies.setdefault(entry["kind"], verdicts.Tally())
            tally.runs += entry["runs"]
            tally.counts = dict(Counter(tally.counts) + Counter(entry["counts"]))
            tally.faults += [f"{text} (at {entry['commit']})" for text in entry["faults"]]
            where += Counter(entry["where"])
        return tallies, where

    def about(self) -> str:
        """When and on what the runs were made."""
        dates = sorted(entry["date"] for entry in self.entries)
        commits = list(dict.fromkeys(entry["commit"] for entry in self.entries))
        if not commits:
            return "No run yet."
        days = dates[0] if dates[0] == dates[-1] else f"{dates[0]} to {dates[-1]}"
        return f"Runs of {days}, at {'commit' if len(commits) == 1 else 'commits'} {', '.join(commits)}."


def _commit() -> str:
    """The last commit that changed the program, with `+` when its files were changed since."""
    git, program = ["git", "-C", str(REPOSITORY)], ["--", "pipeline", "plugins"]
    try:
        name = subprocess.run(
            [*git, "log", "-1", "--format=%h", "--abbrev=8", *program], check=True, capture_output=True
        )
        changed = subprocess.run([*git, "status", "--porcelain", *program], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return name.stdout.decode().strip() + ("+" if changed.stdout.strip() else "")
