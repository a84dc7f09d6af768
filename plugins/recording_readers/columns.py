"""Columns of a table of numbers, with missing cells; times that increase."""

import csv
from collections.abc import Mapping

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.support import nearest, number_of, read_text, separator_of

MISSING = ("", "nan", "na", "null", "none", "-")
UNITS: Mapping[str, float] = {
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "rad": 1.0, "deg": float(np.radians(1.0)), "turn": 2.0 * np.pi,
    "m/s^2": 1.0, "mm/s^2": 1e-3, "g": 9.80665, "N m": 1.0, "N mm": 1e-3, "N": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6,
    "ns": 1e-9, "": 1.0,
}  # fmt: skip


def read_columns(file: str) -> tuple[dict[str, Array], bool]:
    """Columns by name, NaN where a cell is empty; and whether a comment says that angles are in degrees.

    The head may be a comment (`#time,...`); cells are separated by commas, semicolons or tabs. Where
    it is not by commas, numbers may have a decimal comma.

    Raises:
        ShotError: It cannot be read, or a cell is no number.
    """
    try:
        lines = read_text(file).lstrip("\ufeff").splitlines()
    except UnicodeDecodeError as error:
        raise ShotError(
            "the recording is no text in UTF-8",
            path=file,
            found=f"byte {error.start + 1}",
            remedy="Save it as a table of plain text (CSV) in UTF-8",
        ) from error
    except OSError as error:
        raise ShotError(
            "the recording cannot be read", path=file, found=error.strerror, remedy="Name another file"
        ) from error
    degrees = any(line.startswith("#") and "angle deg" in line for line in lines)
    numbered = [(n, line) for n, line in enumerate(lines, 1) if line.strip()]
    rows = [(n, line) for n, line in numbered if not line.startswith("#")]
    if not rows:
        raise ShotError("the recording is empty", path=file, remedy="Record the performance again")
    separator = separator_of(rows[0][1])
    head, body = rows[0][1], rows[1:]
    if _is_number(head.split(separator)[0]):
        comments = [line for n, line in numbered if line.startswith("#") and n < rows[0][0]]
        if not comments:
            raise ShotError(
                "the recording does not name its columns",
                path=file,
                attribute="line 1",
                found=head[:60],
                remedy="Write a first line with their names, such as time_s,/Arm/Hand/cup.x",
            )
        head, body = comments[-1].lstrip("# "), rows
    if not body:
        raise ShotError(
            "the recording has no row below its head", path=file, found=head[:60], remedy="Record the performance again"
        )
    names = [cell.strip() for cell in next(csv.reader([head], delimiter=separator))]
    repeated = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if repeated is not None:
        raise ShotError("two columns have the same name", path=file, found=repeated, remedy="Rename one of them")
    values = np.full((len(body), len(names)), np.nan)
    for k, (number, line) in enumerate(body):
        row = next(csv.reader([line], delimiter=separator))  # no row goes on in the next line
        try:
            if len(row) != len(names):
                raise ValueError
            values[k] = [_number(cell, separator) for cell in row]
            if np.isinf(values[k]).any():
                raise ValueError
        except ValueError:
            raise ShotError(
                f"a row that does not hold {len(names)} numbers",
                path=file,
                attribute=f"line {number}",
                found=line[:60],
                remedy="Correct the row; leave cells without a sample empty, and separate columns with decimal commas "
                "by semicolons or tabs",
            ) from None
    return {name: values[:, k] for k, name in enumerate(names)}, degrees


def column_of(columns: Mapping[str, Array], name: str, file: str) -> Array:
    """The column of a name; with a `-` before it, its negative.

    Raises:
        ShotError: There is none.
    """
    sign, own = (-1.0, name[1:]) if name.startswith("-") and name not in columns else (1.0, name)
    if own not in columns:
        raise ShotError(
            "the recording has no such column",
            path=file,
            attribute=own,
            found=", ".join(list(columns)[:12]),
            remedy=f"{nearest(own, list(columns))}Correct the map",
        )
    return np.asarray(sign * columns[own])


def increasing(times: Array, file: str, name: str) -> np.ndarray:
    """Which rows have a time after all rows before them; others come twice.

    Raises:
        ShotError: A time is missing, or times go back.
    """
    bad = np.flatnonzero(~np.isfinite(times))
    if len(bad):
        raise ShotError(
            "a row has no time", path=file, attribute=name, found=f"row {bad[0] + 1}", remedy="Remove the row"
        )
    back = np.flatnonzero(np.diff(times) < 0.0)
    if len(back):
        raise ShotError(
            "times must not go back",
            path=file,
            attribute=name,
            found=f"{times[back[0]]:.9g} and then {times[back[0] + 1]:.9g} in row {back[0] + 2}",
            remedy="Sort the rows; give recordings of several runs as several files",
        )
    return np.concatenate([[True], np.diff(times) > 0.0])


def unit_of(name: str, alike: tuple[str, ...], file: str, attribute: str) -> float:
    """SI units in a unit.

    Raises:
        ShotError: It is none of those that fit.
    """
    if name not in alike:
        raise ShotError(
            "this unit does not fit", path=file, attribute=attribute, found=name, remedy=f"Use {', '.join(alike)}"
        )
    return UNITS[name]


def _number(cell: str, separator: str) -> float:
    return np.nan if cell.strip().lower() in MISSING else number_of(cell, separator)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
