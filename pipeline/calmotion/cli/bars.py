"""Bars of a terminal: a line for each stage, and below them what the current stage does."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.text import Text

_BAR = 16  # characters; with the longest label of a bundled operator, a line has less than 80


class Bars(Progress):
    """Bars on stderr; each task has the field `left`, its remaining time as text."""

    def __init__(self) -> None:
        self.message = ""
        super().__init__(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(bar_width=_BAR),
            TimeElapsedColumn(),
            TextColumn("{task.fields[left]}"),
            console=Console(stderr=True),
        )

    def get_renderables(self) -> Iterable[RenderableType]:
        """The bars, and the message on a line of its own: beside them it would be cut."""
        yield self.make_tasks_table(self.tasks)
        if self.message and not self.finished:
            yield Text(f"  {self.message}", style="dim", no_wrap=True, overflow="ellipsis")
