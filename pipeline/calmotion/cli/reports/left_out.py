"""The simplifications of a report: those that cost most, or all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console

from calmotion.cli.quantities import about
from calmotion.cli.tables import say

LISTED = 12  # rows that a report shows by itself; robots with many links have several for each of them


def print_left_out(console: Console, rows: Sequence[dict[str, Any]], whole: bool = True) -> None:
    """The simplifications, each with its reason and estimated error, and the steps that were not needed.

    Args:
        console: Where they are printed.
        rows: Of `left_out`.
        whole: Whether to print all of them, in the order of the report; otherwise of many those that cost most.
    """
    if not whole:
        rows = sorted(rows, key=lambda row: -(row["estimated_error_m"] or 0.0))
    shown = rows if whole else rows[:LISTED]
    for row in shown:
        error = row["estimated_error_m"]
        cost = "" if error is None else f"; estimated error {about(error)}"
        kind = "skipped" if row["skipped"] else "simplified"
        say(console, f"{kind}: {row['what']} ({row['why']}){cost}")
    if len(rows) > len(shown):
        say(console, f"and {len(rows) - len(shown)} more, which cost less: --verbose lists all")
