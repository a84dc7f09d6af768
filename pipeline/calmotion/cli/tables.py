"""Tables, sentences and quantities of reports for a person; rich is imported when one is printed."""

from __future__ import annotations

import math
import os
import shutil
import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import IO, TYPE_CHECKING, Any, Literal, TextIO

from calmotion.model.outputs import TextTable
from calmotion.support.naming import distinct_names

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

LEAST = 1e-7  # length that is told [m]; what is below is rounding
LEAST_ANGLE = 1e-7  # angle that is told [rad]


def length(meters: float | None) -> str:
    """A length or error as text in mm; `-` when it is not known."""
    if meters is None or not math.isfinite(meters):
        return "-"
    if 0.0 < abs(meters) < LEAST:
        return f"< {1000.0 * LEAST:g} mm"
    return f"{1000.0 * meters:.4g} mm" if abs(meters) < 9.9995 else f"{meters:.4g} m"


def up_to(meters: float) -> str:
    """A largest error, after a verb."""
    text = length(meters)
    return f"less than {text[2:]}" if text.startswith("< ") else f"up to {text}"


def about(meters: float | None) -> str:
    """An estimated length or error as text, to two digits."""
    return length(meters if meters is None or not math.isfinite(meters) else float(f"{meters:.2g}"))


def frequency(hertz: float) -> str:
    """A frequency in Hz to four digits, without its unit and without powers of ten."""
    return f"{float(f'{hertz:.4g}'):.10g}"


def angle(radians: float | None) -> str:
    """An angle as text in degrees; `-` when there is none."""
    if radians is None or not math.isfinite(radians):
        return "-"
    degrees = math.degrees(radians)
    if abs(radians) < LEAST_ANGLE:
        return "0°"
    return f"{degrees:.4g}°" if abs(degrees) < 9999.5 else f"{degrees:.0f}°"


def counted(count: int, noun: str) -> str:
    """A number of things: `1 frame`, `2 frames`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


# Larger and smaller units in which a value is told, largest first: (size in SI units, name).
SCALES = {
    "Pa": ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa")),
    "s": ((1.0, "s"), (1e-3, "ms")),
    "m": ((1.0, "m"), (1e-3, "mm")),
    "rad": ((math.pi / 180.0, "°"),),
}
FEWEST, MOST = 0, 7  # digits behind the point


def measured(value: float, deviation: float, unit: str) -> tuple[str, str]:
    """A value and its standard deviation, in SI, as texts in one unit and to two digits of the deviation.

    `1.5993e9, 4.9e6, "Pa"` is `1.5993 GPa`, `0.0049 GPa`.
    """
    size, name = _scale(max(abs(value), deviation), unit)
    scaled = deviation / size
    if not 0.0 < scaled < math.inf:
        return _with(f"{value / size:.5g}", name), "-"
    digits = min(max(1 - math.floor(math.log10(scaled)), FEWEST), MOST)
    rounded = round(value / size, digits) + 0.0  # no negative zero
    return _with(f"{rounded:.{digits}f}", name), _with(f"{scaled:.{digits}f}", name)


def quantity_in(value: float, unit: str, digits: int = 5) -> str:
    """A value in SI as text with its unit."""
    size, name = _scale(abs(value), unit)
    return _with("0" if abs(value) < 1e-12 else f"{value / size:.{digits}g}", name)


def _scale(largest: float, unit: str) -> tuple[float, str]:
    scales = SCALES.get(unit, ((1.0, unit),))
    return next((scale for scale in scales if largest >= scale[0]), scales[-1])


def _with(number: str, unit: str) -> str:
    return f"{number}{unit}" if unit == "°" else f"{number} {unit}".rstrip()


_FILE_WIDTH = 200  # characters of a line in a file, where nothing needs to be folded
SHORTENED = "(… stands for the start of a prim path; --json has whole paths)"


def width_of(stream: IO[str]) -> int | None:
    """Characters of a line on a stream; None in a file, unless COLUMNS gives it, as for other programs."""
    limited = stream.isatty() or os.environ.get("COLUMNS", "").isdigit()
    return max(shutil.get_terminal_size().columns, 20) if limited else None


def filled(text: str, stream: IO[str], indent: str = "  ") -> str:
    """A text whose lines are wrapped between words where the stream is a terminal; no word is broken.

    Args:
        text: One or several lines.
        stream: Where it will be printed.
        indent: Before each further line of what is wrapped.
    """
    width = width_of(stream)
    if width is None:
        return text
    return "\n".join(
        textwrap.fill(
            line,
            width,
            subsequent_indent=" " * (len(line) - len(line.lstrip())) + indent,
            break_long_words=False,
            break_on_hyphens=False,
        )
        for line in text.split("\n")
    )


def console_on(stream: TextIO) -> Console:
    """A console on a stream; as wide as the terminal, and wide in a file."""
    from rich.console import Console

    return Console(file=stream, highlight=False, markup=False, emoji=False, width=width_of(stream) or _FILE_WIDTH)


def with_texts(value: Any, change: Callable[[str], str]) -> Any:
    """A value of a report with each text in it changed; the keys of its tables stay."""
    if isinstance(value, str):
        return change(value)
    if isinstance(value, Mapping):
        return {key: with_texts(inner, change) for key, inner in value.items()}
    return [with_texts(inner, change) for inner in value] if isinstance(value, list | tuple) else value


def say(console: Console, text: str) -> None:
    """Print a sentence, wrapped between words on a terminal."""
    if (parts := getattr(console, "parts", None)) is not None:  # of a page
        parts.append(text)
        return
    print(filled(text, console.file), file=console.file)


def print_table(
    console: Console, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], texts: int = 1
) -> None:
    """Print a table; nothing without rows.

    A table that is wider than the console gets shorter prim paths, as far as they stay distinct; what does not fit then
    is folded, never cut.

    Args:
        console: Where it is printed.
        columns: Heads of the columns.
        rows: Cells.
        texts: The first so many columns are text, and the others numbers.
    """
    if not rows:
        return
    if (parts := getattr(console, "parts", None)) is not None:  # of a page
        parts.append(TextTable(title, tuple(columns), tuple(map(tuple, rows)), texts))
        return
    from rich.measure import Measurement

    console.print(title, style="bold", soft_wrap=True)
    shorter: dict[str, str] = {}
    table = _table(columns, rows, texts, console.width)
    unlimited = console.options.update(max_width=10 * _FILE_WIDTH)
    if Measurement.get(console, unlimited, table).maximum > console.width:
        paths = [cell for row in rows for cell in row[:texts] if cell.startswith("/")]
        ends = {path: f"…/{name}" for path, name in distinct_names(paths).items()}
        shorter = {path: end for path, end in ends.items() if len(end) < len(path)}
        short_rows = [[shorter.get(cell, cell) for cell in row] for row in rows]
        table = _table(columns, short_rows, texts, console.width)
    console.print(table)
    if shorter:
        say(console, SHORTENED)


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]], texts: int, width: int) -> Table:
    """A table whose texts stay on one line where the words of its numbers then have room."""
    from rich import box
    from rich.table import Table

    needed = 2 * (len(columns) - 1)
    for number, cells in enumerate(zip(columns, *rows, strict=True)):
        needed += max(len(part) for cell in cells for part in ([cell] if number < texts else cell.split() or [cell]))
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for number, head in enumerate(columns):
        is_text = number < texts
        justify: Literal["left", "right"] = "left" if is_text else "right"
        table.add_column(head, justify=justify, overflow="fold", no_wrap=is_text and needed <= width)
    for row in rows:
        table.add_row(*row)
    return table
