"""The simplifications of a report: those that cost most, or all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console

from calmotion.cli.quantities import about
from calmotion.cli.tables import say

MOST = 12  # rows that a report shows by itself; robots with many links have several for each of them


def print_left_out(console: Console, rows: Sequence[dict[str, Any]], whole: bool = True) -> None:
    """The simplifications, each with its reason and estimated error, and the steps that were not needed.

    Args:
        console: Where they are printed.
        rows: Of `left_out`.
        whole: Whether to print all of them; otherwise of many those that cost most, in the order of the report.
    """
    # a line about one that is left out is no shorter than the one itself
    shown, rest = (rows, []) if whole or len(rows) <= MOST + 1 else _largest(rows)
    for row in shown:
        error = row["estimated_error_m"]
        cost = "" if error is None else f"; estimated error {about(error)}"
        kind = "skipped" if row["skipped"] else "simplified"
        say(console, f"{kind}: {row['what']} ({row['why']}){cost}")
    if rest:
        error = max(_error(row) for row in rest)
        cost = f"with estimated errors of at most {about(error)} each" if error else "without an error"
        say(console, f"and {len(rest)} more {cost}: --verbose lists all")


def _largest(rows: Sequence[dict[str, Any]]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Those that cost most, and the others."""
    least = sorted(range(len(rows)), key=lambda k: -_error(rows[k]))
    kept = set(least[:MOST])
    return [row for k, row in enumerate(rows) if k in kept], [row for k, row in enumerate(rows) if k not in kept]


def _error(row: dict[str, Any]) -> float:
    return float(row["estimated_error_m"] or 0.0)
