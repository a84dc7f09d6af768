"""What every benchmark does beside its measurement: arguments, rows that are kept as they come, tables, one object."""

import argparse
import csv
import json
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
from calmotion import ShotError
from calmotion.cli import console_on, json_option, length, print_table

from .shots import load

UNITS = {"_s": "s", "_ms": "ms", "_mm": "mm", "_hz": "Hz", "_deg": "°", "_gb": "GB", "_percent": "%"}
UNITS |= {"_kg": "kg", "_cm3": "cm^3"}


class _Paragraphs(argparse.HelpFormatter):
    """Wraps each paragraph and each item of a description on its own."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        paragraphs = re.split(r"\n\s*\n|\n(?=- )", text.strip())
        return "\n".join(super(_Paragraphs, self)._fill_text(part, width, indent) for part in paragraphs)


def bench_parser(name: str, description: str | None, shots: Sequence[str] = ()) -> argparse.ArgumentParser:
    """A parser with what all benchmarks have: --json, --csv, --markdown, and the shots where there are some.

    Args:
        name: Of the benchmark.
        description: In one paragraph or several.
        shots: Samples that are taken where none is named.
    """
    parser = argparse.ArgumentParser(
        prog=f"calmotion bench {name}", description=description, formatter_class=_Paragraphs
    )
    json_option(parser)
    parser.add_argument("--csv", metavar="FILE", help="also write all columns, after each row")
    parser.add_argument("--markdown", metavar="FILE", help="also write the table as Markdown")
    if shots:
        names = "the samples" if len(shots) > 2 else " and ".join(shots)
        parser.add_argument(
            "shots", metavar="SHOT", nargs="*", default=list(shots), help=f"USD file (default: {names})"
        )
    return parser


def numbered_options(parser: argparse.ArgumentParser, count: int, first: int = 0) -> None:
    """The options of a benchmark that draws what it measures by a number: `numbered` runs it."""
    parser.add_argument("--count", type=int, default=count, metavar="N", help=f"how many are drawn (default: {count})")
    parser.add_argument("--first", type=int, default=first, metavar="K", help=f"the first number (default: {first})")
    parser.add_argument("--resume", action="store_true", help="keep the rows that the file of --csv has")


def numbered(options: argparse.Namespace, kind: type[Any], number: str, measure: Callable[[int], Any]) -> list[Any]:
    """The rows of all numbers, each written as soon as it is known; one that is refused has none, and says why.

    Args:
        options: Of `numbered_options` and `bench_parser`.
        kind: Dataclass of the rows.
        number: Name of its field with the number.
        measure: Gives the rows of a number.
    """
    rows = kept_rows(options, kind)
    known = {getattr(row, number) for row in rows}
    for k in range(options.first, options.first + options.count):
        if k in known:
            continue
        try:
            own = measure(k)
        except ShotError as error:
            say(f"{number} {k} is refused: {error.problem}")
            continue
        rows = sorted([*rows, *own], key=lambda row: int(getattr(row, number)))
        for row in own:
            say(", ".join(f"{head} {cell}" for head, cell in zip(heads_of(kind), cells_of(row), strict=True) if cell))
        keep(options, kind, rows)
    return rows


def on_shots(
    options: argparse.Namespace, title: str, kind: type[Any], compare: Callable[[str, Any], Iterable[Any]]
) -> int:
    """Measure all shots of a command by their names and print what was found; the exit status.

    Args:
        options: Of `bench_parser`.
        title: Of the table.
        kind: Dataclass of the rows.
        compare: Gives the rows of a shot that can be optimised.
    """
    rows: list[Any] = []
    for path in options.shots:
        rows += compare(Path(path).stem, load(path))
        say(f"{path} is done")
        keep(options, kind, rows)
    finish(options, title, rows)
    return 0


def keep(options: argparse.Namespace, kind: type[Any], rows: Iterable[Any]) -> None:
    """Write the rows so far to the file of --csv, where one is named: the next may take long."""
    if not options.csv:
        return
    with open(options.csv, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(kind)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)


def kept_rows(options: argparse.Namespace, kind: type[Any]) -> list[Any]:
    """The rows of the file that is to be resumed (`--resume` with `--csv FILE`); none otherwise.

    Raises:
        ShotError: It is not a table of this benchmark.
    """
    if not (options.resume and options.csv and Path(options.csv).exists()):
        return []
    types = get_type_hints(kind)
    read = {name: (lambda text: text == "True") if own is bool else own for name, own in types.items()}
    with open(options.csv, newline="", encoding="utf-8") as file:
        try:
            return [kind(**{name: read[name](text) for name, text in row.items()}) for row in csv.DictReader(file)]
        except (KeyError, TypeError, ValueError) as error:
            raise ShotError(
                "is not a table of this benchmark",
                path=options.csv,
                found=str(error),
                remedy="Name another file with --csv",
            ) from None


def finish(
    options: argparse.Namespace,
    title: str,
    rows: Sequence[Any],
    table: tuple[Sequence[str], Sequence[Sequence[str]]] | None = None,
    lines: Sequence[str] = (),
    columns: Sequence[str] = (),
    **more: object,
) -> None:
    """Print what a benchmark found: a table and some lines, or one object with --json; write it with --markdown.

    Args:
        options: Of `bench_parser`.
        title: Of the table.
        rows: Dataclasses of one kind, in the object as `rows`.
        table: Heads and cells; the rows themselves without it.
        lines: Sentences below the table.
        columns: Fields that the table of the rows has; all without them.
        more: What else the object has.
    """
    own = (heads_of(type(rows[0]), columns), [cells_of(row, columns) for row in rows]) if rows else ((), [])
    heads, cells = table or own
    if options.markdown:
        written = [heads, ["---"] * len(heads), *cells]
        text = "".join("| " + " | ".join(cell.replace("|", "/") for cell in line) + " |\n" for line in written)
        Path(options.markdown).write_text(text + "".join(f"\n{line}\n" for line in lines), encoding="utf-8")
    if options.json:
        print(json.dumps({"rows": [asdict(row) for row in rows], **more}))
        return
    show(title, heads, cells)
    for line in lines:
        print(line)


def show(title: str, heads: Sequence[str], cells: Sequence[Sequence[str]]) -> None:
    """Print a table for a person."""
    print_table(console_on(sys.stdout), title, heads, cells)


def heads_of(kind: type[Any], columns: Sequence[str] = ()) -> list[str]:
    """Heads of the table of a dataclass: the names of its fields, or of some of them, without their units."""
    names = columns or [field.name for field in fields(kind)]
    return [name.removesuffix(_unit(name)).replace("_", " ") for name in names]


def cells_of(row: Any, columns: Sequence[str] = ()) -> list[str]:
    """Cells of the table of a dataclass; the names of the fields tell their units."""
    return [_cell(name, getattr(row, name)) for name in columns or [field.name for field in fields(row)]]


def _unit(name: str) -> str:
    return next((unit for unit in (*UNITS, "_m") if name.endswith(unit)), "")


def _cell(name: str, value: object) -> str:
    if value is None or (isinstance(value, float) and np.isnan(value)):
        return "-"
    if not isinstance(value, float):
        return ("yes" if value else "no") if isinstance(value, bool) else str(value)
    unit = _unit(name)
    return length(value) if unit == "_m" else f"{value:.3g} {UNITS.get(unit, '')}".strip()


def say(text: str) -> None:
    """Tell the person who waits for the result how far it is, beside the result."""
    print(text, file=sys.stderr, flush=True)
