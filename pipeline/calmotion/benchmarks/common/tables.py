"""Tables of measurements."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields
from typing import Any


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
