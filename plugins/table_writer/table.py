"""Columns as a CSV file."""

import csv
from collections.abc import Mapping

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import file_access
from calmotion.support import replaced

AT_ONCE = 4096  # rows that are in memory at once


def write_table(path: str, table: Mapping[str, Array]) -> None:
    """Write columns as CSV, atomically: `path` holds the old table or the whole new one.

    Raises:
        ShotError: When the file cannot be written.
    """
    columns = list(table.values())
    rows = len(columns[0]) if columns else 0
    with file_access("the table cannot be written", path, "Choose another file for --csv."):
        with replaced(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(table)
            for start in range(0, rows, AT_ONCE):  # the text of a long shot has hundreds of megabytes
                part = np.column_stack([column[start : start + AT_ONCE] for column in columns])
                writer.writerows([f"{value:.12g}" for value in row] for row in part)
