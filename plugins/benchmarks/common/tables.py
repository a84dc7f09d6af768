"""Tables of measurements."""

from __future__ import annotations

import argparse
import csv
import json
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, get_type_hints

from calmotion import ShotError


def write_rows(path: str, kind: type[Any], rows: Iterable[Any]) -> None:
    """Write dataclasses of one kind as CSV: a column a field, a row each."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(kind)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)


def read_rows(path: str, kind: type[Any]) -> list[Any]:
    """The rows that `write_rows` wrote, of one kind of dataclass with numbers, texts and truth values; none of no file.

    Raises:
        ShotError: The file has other columns, or a value that is none of its column.
    """
    if not Path(path).exists():
        return []
    hints = get_type_hints(kind)
    names = [field.name for field in fields(kind)]
    with open(path, newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        if list(reader.fieldnames or []) != names:
            raise ShotError(
                "the table has other columns than those of this benchmark", path=path,
                found=", ".join(reader.fieldnames or ["nothing"]), remedy="Name another file with --csv",
            )  # fmt: skip
        rows = list(reader)
    found = []
    for number, row in enumerate(rows, 2):
        values = {}
        for name in names:
            try:
                values[name] = (
                    {"True": True, "False": False}[row[name]] if hints[name] is bool else hints[name](row[name])
                )
            except (KeyError, TypeError, ValueError):
                raise ShotError(
                    f"line {number} of the table has no value of its column", path=path, attribute=name,
                    found=row[name], remedy="Repair or remove the line: what it held is measured again",
                ) from None  # fmt: skip
        found.append(kind(**values))
    return found


def resumed_rows(parser: argparse.ArgumentParser, options: argparse.Namespace, kind: type[Any]) -> list[Any]:
    """The rows of the file that is to be resumed (`--resume` with `--csv FILE`); none otherwise.

    Raises:
        ShotError: As `read_rows`.
    """
    if not options.resume:
        return []
    if not options.csv:
        parser.error("--resume needs --csv FILE, with the rows that are kept")
    return read_rows(options.csv, kind)


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]], rule: str = "---") -> str:
    """A Markdown table; `rule` aligns all columns but the first."""
    lines = [heads, ["---", *[rule] * (len(heads) - 1)], *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def show(title: str, heads: Sequence[str], rows: Sequence[Sequence[str]], texts: int = 1) -> None:
    """Print a table for a person.

    Args:
        title: Above it.
        heads: Of the columns.
        rows: Their cells.
        texts: The first so many columns are text, and the others numbers.
    """
    from calmotion.cli import console_on, print_table

    print_table(console_on(sys.stdout), title, heads, rows, texts=texts)


def finish(
    options: argparse.Namespace, title: str, heads: Sequence[str], rows: Sequence[Sequence[str]], found: object,
    texts: int = 1,
) -> None:  # fmt: skip
    """Print what a benchmark found: a table, or one object with --json; write the table with --markdown.

    Args:
        options: Of `parsers.output_options`.
        title, heads, rows, texts: Of the table, as of `show`.
        found: What --json prints.
    """
    if getattr(options, "markdown", None):
        Path(options.markdown).write_text(markdown(heads, rows), encoding="utf-8")
    if options.json:
        print(json.dumps(found))
    else:
        show(title, heads, rows, texts)


def say(text: str) -> None:
    """Tell the person who waits for the result how far it is, beside the result."""
    print(text, file=sys.stderr, flush=True)
