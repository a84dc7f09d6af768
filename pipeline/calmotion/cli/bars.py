"""Bars of a terminal: a line for each stage, and below them what the current stage does."""

import sys
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
        message = compiling() or self.message
        if message and not self.finished:
            yield Text(f"  {message}", style="dim", no_wrap=True, overflow="ellipsis")


def compiling() -> str:
    """Which kernel is being compiled, and how long that still takes; empty where none is.

    A run imports the compiler when it needs kernels; to ask does not.
    """
    loaded = sys.modules.get("calmotion.support.compilation")
    if loaded is None or not loaded.compiling.kernel:
        return ""
    text = f"compiling kernels, once after an installation: {loaded.compiling.kernel}"
    left = time_left(loaded.compiling.time_left_s)
    return f"{text}, {left}" if left else text


def time_left(seconds: float | None) -> str:
    """A remaining time [s] as text; empty where it is not known or below two seconds."""
    if seconds is None or seconds < 2.0:
        return ""
    if seconds < 100.0:
        return f"about {seconds:.0f} s left"
    return f"about {seconds / 60.0:.0f} min left" if seconds < 6000.0 else f"about {seconds / 3600.0:.1f} h left"
