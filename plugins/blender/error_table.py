# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the table of an optimisation: where each target was at each frame, and how far off. Does not import bpy."""

from __future__ import annotations

import csv
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

Place = tuple[float, float, float]


@dataclass(frozen=True)
class TargetErrors:
    """One target at each frame.

    Attributes:
        path: Its prim.
        before, after: Places as animated and optimised [m].
        error_before, error_after: Distances to the intended place [m].
    """

    path: str
    before: tuple[Place, ...]
    after: tuple[Place, ...]
    error_before: tuple[float, ...]
    error_after: tuple[float, ...]

    @property
    def name(self) -> str:
        """The last name of its prim path."""
        return self.path.rsplit("/", 1)[-1]


def read_errors(table: Path, times: Sequence[float]) -> list[TargetErrors]:
    """The targets of a table that `calmotion optimize --csv` wrote.

    Args:
        table: The file.
        times: Of the frames, after the first one [s].

    Raises:
        ValueError: It is no such table.
    """
    with table.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    if "time_s" not in head or not rows:
        raise ValueError(f"{table} has no column time_s, or no row")
    columns = {name: [float(row[k]) for row in rows] for k, name in enumerate(head) if _wanted(name)}
    paths = [name.removesuffix(".error") for name in columns if name.endswith(".error")]

    def curve(name: str) -> tuple[float, ...]:
        if name not in columns:
            raise ValueError(f"{table} has no column {name}")
        return tuple(at(columns["time_s"], columns[name], time) for time in times)

    def places(path: str, end: str) -> tuple[Place, ...]:
        return tuple(zip(*(curve(f"{path}.{axis}{end}") for axis in "xyz"), strict=True))

    return [
        TargetErrors(
            path, places(path, "_before"), places(path, ""), curve(f"{path}.error_before"), curve(f"{path}.error")
        )
        for path in paths
    ]


def _wanted(name: str) -> bool:
    return name == "time_s" or name.removesuffix("_before").endswith((".x", ".y", ".z", ".error"))


def at(times: Sequence[float], values: Sequence[float], time: float) -> float:
    """A value between the rows of a table: linear, and constant before the first and after the last."""
    after = bisect_right(times, time)
    if after in (0, len(times)):
        return values[min(after, len(times) - 1)]
    share = (time - times[after - 1]) / (times[after] - times[after - 1])
    return (1.0 - share) * values[after - 1] + share * values[after]


def largest(targets: Sequence[TargetErrors]) -> tuple[list[float], list[float]]:
    """The largest error of all targets at each frame [m], as animated and optimised."""
    before = [max(values) for values in zip(*(target.error_before for target in targets), strict=True)]
    return before, [max(values) for values in zip(*(target.error_after for target in targets), strict=True)]
