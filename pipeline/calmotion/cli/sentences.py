"""Sentences on a terminal: wrapped between words, so that no name is cut and a number keeps its unit."""

from __future__ import annotations

import os
import re
import shutil
import textwrap
from typing import TextIO

_UNIT = re.compile(r"(?<=[0-9]) (?:N m|mm|m|cm\^3|deg|s|ms|Hz|kg|N|B|kB|MB|GB|%)(?![\w/])")
_GLUE = "\N{NO-BREAK SPACE}"  # `textwrap` breaks lines at ordinary spaces alone


def width_of(stream: TextIO) -> int | None:
    """Characters of a line on a stream; None in a file, where nothing needs to be wrapped.

    COLUMNS decides where it is set, as in other programs.
    """
    try:
        terminal = stream.isatty()
    except ValueError:  # closed
        return None
    if not terminal and not os.environ.get("COLUMNS", "").isdigit():
        return None
    return max(shutil.get_terminal_size((80, 24)).columns, 20)


def unbroken(name: object) -> str:
    """A name, such as that of a file, which `wrapped` leaves on one line."""
    return str(name).replace(" ", _GLUE)


def wrapped(text: str, width: int | None, indent: str = "  ") -> str:
    """A text in lines of at most `width` characters, where no word is longer; as it is without a width.

    Args:
        text: One or several lines; each is wrapped on its own.
        width: Characters of a line, or None.
        indent: Before each further line of what is wrapped.
    """
    lines = text.split("\n")
    if width is not None:
        lines = [_wrapped_line(line, width, indent) for line in lines]
    return "\n".join(lines).replace(_GLUE, " ")


def _wrapped_line(line: str, width: int, indent: str) -> str:
    if len(line) <= width:
        return line
    own = line[: len(line) - len(line.lstrip(" "))]
    return textwrap.fill(
        _UNIT.sub(lambda unit: unbroken(unit[0]), line.lstrip(" ")),
        width,
        initial_indent=own,
        subsequent_indent=own + indent,
        break_long_words=False,  # a prim path is copied by the reader
        break_on_hyphens=False,
    )
