"""The simplifications of a report: a line, or all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console

from calmotion.cli.quantities import about, counted
from calmotion.cli.tables import say


def print_left_out(console: Console, rows: Sequence[dict[str, Any]], whole: bool = True) -> None:
    """The simplifications of the model.

    Args:
        console: Where they are printed.
        rows: Of `left_out`.
        whole: Whether to print all of them, with their reasons and the steps that were not needed; otherwise a line.
    """
    if whole:
        for row in rows:
            error = row["estimated_error_m"]
            cost = "" if error is None else f"; estimated error {about(error)}"
            kind = "skipped" if row["skipped"] else "simplified"
            say(console, f"{kind}: {row['what']} ({row['why']}){cost}")
        return
    made = [row for row in rows if not row["skipped"]]
    if made:
        largest = max(made, key=lambda row: row["estimated_error_m"] or 0.0)
        error = largest["estimated_error_m"]
        cost = f"; the largest error, about {about(error)}, has: {largest['what']}" if error else ""
        say(console, f"simplified: the model, in {counted(len(made), 'way')}{cost}. --verbose lists all")
