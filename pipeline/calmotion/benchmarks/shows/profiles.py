"""Errors of targets over time, from the tables that `--csv` writes: the largest of each, and how far two are apart."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.benchmarks.common.tables import markdown
from calmotion.shot.character import Array


@dataclass(frozen=True)
class TargetErrors:
    """Errors of one target in a run.

    Attributes:
        path: Of its prim.
        before_mm, after_mm: Largest error, as animated and in the result.
        after_s: When that of the result is [s].
        rms_mm: Root mean square of the error after.
    """

    path: str
    before_mm: float
    after_mm: float
    after_s: float
    rms_mm: float


def target_errors(report: dict[str, Any], csv_file: Path) -> tuple[TargetErrors, ...]:
    """The errors of all targets.

    Args:
        report: The object of `calmotion optimize --json`.
        csv_file: The table that the same run wrote.
    """
    columns, found = read_columns(csv_file), []
    shown = columns["time_s"] >= -1e-9
    for row in report["targets"]:
        at = columns["time_s"][shown][np.argmax(columns[f"{row['path']}.error"][shown])]
        before, after, rms = (row[f"{name}_m"] for name in ("max_error_before", "max_error_after", "rms_error_after"))
        found.append(TargetErrors(row["path"], 1e3 * before, 1e3 * after, float(at), 1e3 * rms))
    return tuple(found)


def errors_table(targets: Sequence[TargetErrors]) -> str:
    """The errors of all targets as Markdown."""
    rows = [
        [
            target.path,
            f"{target.before_mm:.1f} mm",
            f"{target.after_mm:.2f} mm",
            f"{target.after_s:.2f} s",
            f"{target.rms_mm:.2f} mm",
        ]
        for target in targets
    ]
    return markdown(["target", "largest error before", "after", "when", "rms after"], rows)


@dataclass(frozen=True)
class Apart:
    """How far two results of the same performance are from each other.

    Attributes:
        distance_m: Largest distance between a target in the one and in the other [m].
        profile_m: Largest difference of the errors of a target [m].
        profile_s: When that is [s].
        profile_rms_m: Root mean square of the difference, of the target with the largest one [m].
    """

    distance_m: float
    profile_m: float
    profile_s: float
    profile_rms_m: float


def apart(one: Path, two: Path) -> Apart:
    """How far two tables are from each other; their steps may differ."""
    first, second = read_columns(one), read_columns(two)
    at = first["time_s"][first["time_s"] >= -1e-9]
    distance, found = 0.0, Apart(0.0, 0.0, 0.0, 0.0)
    for name in (name for name in first if name.endswith(".error") and not name.endswith("rotation_error")):
        parts = [f"{name.removesuffix('.error')}{axis}" for axis in (".x", ".y", ".z")]
        gaps = [_at(first, part, at) - _at(second, part, at) for part in parts]
        distance = max(distance, float(np.linalg.norm(gaps, axis=0).max()))
        profile = np.abs(_at(first, name, at) - _at(second, name, at))
        k, rms = int(np.argmax(profile)), float(np.sqrt(np.mean(profile**2)))
        found = max(found, Apart(0.0, float(profile[k]), float(at[k]), rms), key=lambda part: part.profile_m)
    return replace(found, distance_m=distance)


def read_columns(path: Path) -> dict[str, Array]:
    """The columns of a table by their heads."""
    with open(path, encoding="utf-8", newline="") as file:
        heads = next(csv.reader(file))
        values = np.loadtxt(file, delimiter=",", ndmin=2)
    return {name: values[:, k] for k, name in enumerate(heads)}


def _at(columns: dict[str, Array], name: str, times: Array) -> Array:
    return np.interp(times, columns["time_s"], columns[name])
