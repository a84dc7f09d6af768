"""All groups of hostile cases."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1] / "helpers" / "usd")]

import commands  # noqa: E402
import contradictions  # noqa: E402
import files  # noqa: E402
import motions  # noqa: E402
import physics  # noqa: E402
import scenes  # noqa: E402
import takes  # noqa: E402
from broken_shots import CASES as BROKEN  # noqa: E402
from hostile import DONE, REFUSED, SHOT, Case  # noqa: E402


def broken(case: Any) -> Case:
    """A broken shot, simulated: refused by its place, or done where it can be repaired."""
    words = ("simulate", SHOT, "-o", "out.usda", "--json", "--step", "20ms")
    return Case(case.make, words, REFUSED if case.place else DONE, case.place)


GROUPS: dict[str, dict[str, Case]] = {
    "motions": motions.CASES,
    "commands": commands.CASES,
    "contradictions": contradictions.CASES,
    "files": files.CASES,
    "physics": physics.CASES,
    "recordings": takes.CASES,
    "scenes": scenes.CASES,
}
# Shots that are broken in one way each are refused by `tests/refusals`, in this way as well.
GROUPS["broken"] = {name: broken(case) for name, case in BROKEN.items()}
CASES: dict[str, Case] = {name: case for cases in GROUPS.values() for name, case in cases.items()}
