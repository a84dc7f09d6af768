"""Tables for a person, which fit the terminal: names are shortened only as far as they stay distinct, and never cut."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from typing import TextIO

from rich.console import Console

from calmotion.cli.sentences import width_of, wrapped
from calmotion.support.naming import distinct_names

_FILE_WIDTH = 200  # characters of a line in a file, where nothing needs to be folded
_GAP = "  "
_PATH = re.compile(r"(?<![\w./])(?:/\w+)+")
_LONGEST_PATH = 40  # letters of a prim path in a sentence
_SHORTENED = "(… stands for the start of a prim path; --json has whole paths)"


class ReportConsole(Console):
    """A console whose sentences name prims by short paths.

    Attributes:
        names: Long prim paths and what stands for them in sentences.
    """

    names: dict[str, str]


def console_on(stream: TextIO, paths: Sequence[str] = ()) -> Console:
    """A console on a stream; as wide as the terminal, and wide in a file.

    Args:
        stream: Where to print.
        paths: Prim paths that sentences may name; long ones are shortened to what tells them apart from the others.
    """
    console = ReportConsole(file=stream, highlight=False, markup=False, width=width_of(stream) or _FILE_WIDTH)
    console.names = {path: name for path, name in short_paths(paths).items() if len(path) > _LONGEST_PATH}
    return console


def say(console: Console, text: str) -> None:
    """Print a sentence, wrapped between words."""
    if isinstance(console, ReportConsole):
        text = _PATH.sub(lambda found: console.names.get(found[0], found[0]), text)
    console.print(wrapped(text, console.width), soft_wrap=True)


def paths_in(sentences: Sequence[str]) -> list[str]:
    """The prim paths in sentences."""
    return [path for sentence in sentences for path in _PATH.findall(sentence)]


def short_paths(paths: Sequence[str]) -> dict[str, str]:
    """Each prim path with an ellipsis for its start, where it stays distinct from the others and becomes shorter."""
    ends = {path: f"…/{name}" for path, name in distinct_names(paths).items()}
    return {path: end if len(end) < len(path) else path for path, end in ends.items()}


def print_table(
    console: Console, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], texts: int = 1
) -> None:
    """Print a table; nothing without rows.

    A table that is wider than the console gets shorter prim paths; where that does not suffice, it becomes a list.

    Args:
        console: Where it is printed.
        title: Of the table.
        columns: Heads of the columns.
        rows: Cells; a cell may be wrapped after a comma, nowhere else.
        texts: The first so many columns are text, and the others numbers.
    """
    if not rows:
        return
    console.print(wrapped(title, console.width), style="bold", soft_wrap=True)
    names = short_paths([cell for row in rows for cell in row[:texts] if cell.startswith("/")])
    short = [[names.get(cell, cell) for cell in row] for row in rows]
    for cells in (rows, short):
        widths = _widths(columns, cells, console.width)
        if widths is not None:
            lines = _table(columns, cells, widths, texts)
            break
    else:
        cells, lines = rows, _list(columns, rows, console.width)
    for line in lines:
        console.print(line.rstrip(), soft_wrap=True)
    if cells is short and any(name != path for path, name in names.items()):
        say(console, _SHORTENED)


def _widths(columns: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[int] | None:
    """The width of each column, or None where the table does not fit."""
    widths, wishes = [], []
    for head, *cells in zip(columns, *rows, strict=True):
        pieces = [piece for cell in cells for piece in _pieces(cell)]
        widths.append(max(map(len, [*head.split(), *pieces]), default=0))
        wishes.append((max(map(len, cells)), len(head)))
    room = width - sum(widths) - len(_GAP) * (len(columns) - 1)
    if room < 0:
        return None
    for of_head in (False, True):  # whole cells first, then whole heads
        for index, wish in enumerate(wishes):
            grown = min(max(wish[of_head] - widths[index], 0), room)
            widths[index] += grown
            room -= grown
    return widths


def _pieces(cell: str) -> list[str]:
    """What of a cell stays on one line."""
    parts = cell.split(", ")
    return [f"{part}," for part in parts[:-1]] + parts[-1:]


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]], widths: Sequence[int], texts: int) -> list[str]:
    """The lines of a table."""

    def lines_of(cells: Sequence[Sequence[str]]) -> list[str]:
        height = max(map(len, cells))
        full = [[*cell, *[""] * (height - len(cell))] for cell in cells]
        return [
            _GAP.join(aligned(column, line) for column, line in enumerate(parts)) for parts in zip(*full, strict=True)
        ]

    def aligned(column: int, text: str) -> str:
        return text.ljust(widths[column]) if column < texts else text.rjust(widths[column])

    heads = [textwrap.wrap(head, width) or [""] for head, width in zip(columns, widths, strict=True)]
    lines = [*lines_of(heads), _GAP.join("─" * width for width in widths)]
    for row in rows:
        lines += lines_of([_folded(cell, width) for cell, width in zip(row, widths, strict=True)])
    return lines


def _folded(cell: str, width: int) -> list[str]:
    """The lines of a cell, broken after commas."""
    lines = [""]
    for piece in _pieces(cell):
        longer = f"{lines[-1]} {piece}" if lines[-1] else piece
        if len(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(piece)
    return lines


def _list(columns: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[str]:
    """The lines of a list: the first cell of each row, and below it the others with their heads."""
    lines: list[str] = []
    for name, *values in rows:
        lines.append(f"  {name}")
        told = "; ".join(f"{head} {value}".strip() for head, value in zip(columns[1:], values, strict=True))
        lines += wrapped(f"    {told}", width, "").split("\n")
    return lines
