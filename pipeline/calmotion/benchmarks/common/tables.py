"""Tables of measurements."""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields
from typing import Any

from calmotion.benchmarks.common.shots import MADE


def write_rows(path: str, kind: type[Any], rows: Iterable[Any]) -> None:
    """Write dataclasses of one kind as CSV: a column a field, a row each."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(kind)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]], rule: str = "---") -> str:
    """A Markdown table; `rule` aligns all columns but the first."""
    lines = [heads, ["---", *[rule] * (len(heads) - 1)], *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def shots_parser(name: str, description: str | None) -> argparse.ArgumentParser:
    """The arguments of a benchmark that runs on shots, or on the synthetic ones of `MADE`."""
    made = "; ".join(f"{shot}: {text}" for shot, text in MADE.items())
    parser = argparse.ArgumentParser(prog=f"calmotion bench {name}", description=description)
    parser.add_argument(
        "shots", metavar="SHOT", nargs="*", default=["arm", "linkage"],
        help=f"USD file, or a synthetic shot ({made}); default: arm linkage",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout, and nothing else there")
    return parser


def table_parser(
    name: str, description: str | None, shots: Sequence[str], tolerances: Sequence[float]
) -> argparse.ArgumentParser:
    """The arguments of a benchmark that simulates shots with several tolerances and prints a table."""
    parser = argparse.ArgumentParser(prog=f"calmotion bench {name}", description=description)
    parser.add_argument("shots", metavar="SHOT", nargs="*", default=list(shots), help="USD file (default: samples)")
    parser.add_argument("--tolerances", metavar="METRES", nargs="+", type=float, default=list(tolerances))
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout, and nothing else there")
    parser.add_argument("--csv", metavar="FILE", help="also write a table")
    parser.add_argument("--markdown", metavar="FILE", help="also write the table as Markdown")
    return parser
