"""Columns as a CSV file."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping

import numpy as np
from calmotion.errors import ShotError
from calmotion.shot.character import Array
from calmotion.support.files import write_text


def write_table(path: str, table: Mapping[str, Array]) -> None:
    """Write columns as CSV, atomically: `path` holds the old table or the whole new one.

    Raises:
        ShotError: When the file cannot be written.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(table)
    writer.writerows([f"{value:.12g}" for value in row] for row in np.column_stack(list(table.values())))
    try:
        write_text(path, text.getvalue())
    except OSError as error:
        raise ShotError(
            "the table cannot be written", path=path, found=error.strerror, remedy="Choose another file for --csv."
        ) from error
