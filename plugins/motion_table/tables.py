"""Tables of motions: CSV with a head."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import MotorTracks
from calmotion.support import (
    TIME_UNITS,
    TimeColumn,
    counters,
    exact_times,
    instants,
    names_times,
    number_of,
    refuse_lfs_pointers,
    refuse_special,
    separator_of,
    time_column,
    too_large,
)

from .npz import REMEDY, WITHOUT, read_npz, refuse_repeated
from .units import TIME, are_units, named_unit, with_unit

_OUTPUTS = (".error", ".rotation_error", ".input", ".output")  # beside paths of prims, in tables that --csv wrote
_DEGREES = re.compile(r"(angle|units?)\W+deg", re.IGNORECASE)
_LONGEST = 1e5  # of a motion [s]: a day
_UNITS = {"ms": "milliseconds (0.001 s)", "us": "microseconds (1e-6 s)", "ns": "nanoseconds (1e-9 s)"}
_EXPANSION = 12.0  # memory of the lines and numbers of a file, by its size


@dataclass(frozen=True, eq=False)
class Motion:
    """The tracks of a table, and what its columns were taken for where their names do not say it."""

    tracks: MotorTracks
    notes: tuple[str, ...] = ()


def read_motion(path: str, *, angles: str, times: str, rate: float, names: Sequence[str]) -> Motion:
    """The tracks of a table.

    Args:
        path: A .csv or .npz file.
        angles: `rad`, `deg`, or `auto`: as the table says.
        times: Unit of the times of a table, or `auto`: that of their name, else of their values.
        rate: Rows a second of a table without times [Hz]; 0 where it has them.
        names: Joints of the columns of a table without names; `-` leaves one out.

    Raises:
        ShotError: The file cannot be read, or does not hold a motion.
    """
    try:
        refuse_special(path)
        refuse_lfs_pointers([path])
        if reason := too_large(path, _EXPANSION):
            raise OSError(0, f"it is too large for the memory: {reason}")
        is_csv = not path.lower().endswith(".npz")
        left: list[str] = []
        columns, units, angle_unit = _csv(path, names, not rate > 0.0) if is_csv else read_npz(path, names, left)
    except (OSError, UnicodeDecodeError) as error:
        found = error.strerror if isinstance(error, OSError) else error
        remedy = "Name another file" if isinstance(error, OSError) else "Save the table as UTF-8"
        raise ShotError("the motion cannot be read", path=path, found=found, remedy=remedy) from error
    own = _times(columns)
    notes = [f"{path}: leaves out the arrays {', '.join(left)}"] if left else []
    for name in counters(columns):
        if own is None or name not in own.names:
            notes.append(f"{path}: the column {name or 'without a name'} numbers rows, and is no joint")
            columns.pop(name)
    if own is None:
        if not rate > 0.0:
            remedy = f"{REMEDY}; or use {WITHOUT}"
            raise ShotError("the motion has no times", path=path, attribute=TIME, remedy=remedy)
        own = TimeColumn((TIME,), np.arange(len(next(iter(columns.values()), np.zeros(0)))) / rate, "s", True)
    for name in own.names:
        columns.pop(name, None)
    unit = own.unit if times == "auto" else times
    if own.names != (TIME,):
        notes.append(f"{path}: its times are those of {' and '.join(own.names)}, in {_UNITS.get(unit, 'seconds')}")
    _refuse_bad(path, own, columns)
    seconds = exact_times(TIME_UNITS[unit] * (own.values - own.values[0]))
    _refuse_long(path, own.names[0], seconds)
    angle_unit = angle_unit if angles == "auto" else angles
    return Motion(MotorTracks(path, seconds, columns, units, angle_unit), tuple(notes))


def _times(columns: dict[str, Array]) -> TimeColumn | None:
    """The times of a table: `time_s`, or a column that is named like them."""
    if TIME in columns:
        return TimeColumn((TIME,), columns[TIME], "s", True)
    found = time_column(columns)
    if found is None and "" in columns and "" not in counters(columns):  # as pandas writes an index
        found = time_column({"time": columns[""]})
        return None if found is None else replace(found, names=("",))
    return found


def _csv(path: str, names: Sequence[str], timed: bool) -> tuple[dict[str, Array], dict[str, str], str]:
    """Columns by name, the units of those that have one, and that of the other angles.

    Cells are separated by commas, semicolons, tabs or spaces; where it is not by commas, numbers may have a decimal
    comma.

    Args:
        timed: Whether a column of times counts where other names are given for all columns.
    """
    with open(path, encoding="utf-8-sig", newline="") as stream:
        lines = [(n, line) for n, line in enumerate(stream.read().splitlines(), 1) if line.strip()]
    degrees = any(line.startswith("#") and _DEGREES.search(line) for _, line in lines)
    comments = [line for _, line in lines if line.startswith("#")]
    lines = [(n, line) for n, line in lines if not line.startswith("#")]
    if not lines:
        raise ShotError("the motion is empty", path=path, remedy=REMEDY)
    between = separator_of(lines[0][1])
    if comments and _is_number(lines[0][1].split(between)[0]):
        if comments[-1].count(between) == lines[0][1].count(between) > 0:
            lines.insert(0, (lines[0][0], comments[-1].lstrip("# ")))  # the head is a comment, as NumPy writes it
    try:
        rows = [_cells(line, between) for _, line in lines]
    except csv.Error as error:
        raise ShotError("this is no table", path=path, found=error, remedy=REMEDY) from None
    head = [cell.strip() for cell in rows[0]]
    if _is_number(head[0]):
        if not names:
            raise ShotError(
                "the table has no names of joints",
                path=path,
                attribute="line 1",
                found=",".join(head[:4]),
                remedy=f"{REMEDY}; or use {WITHOUT}",
            )
        head = list(names)
    else:
        if len(names) == len(head):  # names of other columns, as the remedy says
            kept = [
                timed and new == "-" and (old == TIME or names_times(old)) for old, new in zip(head, names, strict=True)
            ]
            head = [old if own else new for old, new, own in zip(head, names, kept, strict=True)]
        rows, lines = rows[1:], lines[1:]
        if rows and len(rows[0]) == len(head) and are_units(rows[0]):
            head = [with_unit(name, cell) for name, cell in zip(head, rows[0], strict=True)]
            rows, lines = rows[1:], lines[1:]
    if any(name.startswith("/") and name.endswith(_OUTPUTS) for name in head):
        raise ShotError(
            "this is a table that --csv wrote",
            path=path,
            found=head[1] if len(head) > 1 else head[0],
            remedy="It is a result, for plots and spreadsheets; name a table of joint angles",
        )
    wrong = next((k for k, row in enumerate(rows) if len(row) != len(head)), None)
    if wrong is not None:
        remedy = "Correct the row"
        if head == list(names) and all(len(row) == len(rows[0]) for row in rows):
            remedy = f"Name all {len(rows[0])} columns with motion.read.joints; - leaves one out"
        raise _wrong_row(path, lines[wrong], len(head), remedy)
    if "" in head and not any(row[head.index("")].strip() for row in rows):  # a comma at the end of each line
        head[head.index("")] = "-"
    refuse_repeated(path, head)
    columns: dict[str, Array] = {}
    units: dict[str, str] = {}
    for k, name in enumerate(head):
        if name != "-":
            own, unit = named_unit(name)
            columns[own] = _column(path, lines, rows, k, head, between)
            units |= {own: unit} if unit else {}
    return columns, units, "deg" if degrees else "rad"


def _cells(line: str, between: str) -> list[str]:
    """The cells of a row; no row goes on in the next line."""
    return line.split() if between == " " else next(csv.reader([line], delimiter=between, strict=True))


def _column(
    path: str, lines: Sequence[tuple[int, str]], rows: Sequence[Sequence[str]], at: int, head: Sequence[str],
    between: str,
) -> Array:  # fmt: skip
    """The numbers of a column, or its times of a day or dates in seconds."""
    values = np.zeros(len(rows))
    for k, row in enumerate(rows):
        number = _number(row[at], between)
        if number is None:
            found = instants([row[at] for row in rows]) if names_times(head[at]) else None
            if found is not None:
                return found
            kept = [_number(cell, between) is not None or names_times(head[n]) for n, cell in enumerate(row)]
            left = ",".join(name if kept[n] and n != at else "-" for n, name in enumerate(head))
            remedy = "Correct the row (write decimals with a point), or leave the column out with "
            remedy += f"--set motion.read.joints={left}"
            raise _wrong_row(path, lines[k], len(head), remedy)
        values[k] = number
    return values


def _number(cell: str, between: str) -> float | None:
    try:
        return number_of(cell, between)
    except ValueError:
        return None


def _wrong_row(path: str, line: tuple[int, str], count: int, remedy: str) -> ShotError:
    return ShotError(
        f"a row that does not hold {count} numbers",
        path=path,
        attribute=f"line {line[0]}",
        found=line[1][:60],
        remedy=remedy,
    )


def _refuse_bad(path: str, own: TimeColumn, columns: dict[str, Array]) -> None:
    times, named = own.values, own.names[0]
    if not columns:
        raise ShotError("the motion has no joints", path=path, remedy=REMEDY)
    for name, values in ((named, times), *columns.items()):
        if len(values) != len(times):
            raise ShotError(
                f"has another number of values than {named}",
                path=path,
                attribute=name,
                found=f"{len(values)} and {len(times)}",
                remedy="Correct the table",
            )
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise ShotError(
                "is not finite",
                path=path,
                attribute=name,
                found=f"{values[bad[0]]} in row {bad[0] + 1}",
                remedy="Correct or remove the row",
            )
    if len(times) < 2:
        raise ShotError("a motion needs two rows at least", path=path, found=f"{len(times)} rows", remedy=REMEDY)
    back = np.flatnonzero(np.diff(times) <= 0.0)
    if len(back):
        raise ShotError(
            "times must increase",
            path=path,
            attribute=named,
            found=f"{times[back[0]]:g} and then {times[back[0] + 1]:g} in row {back[0] + 2}",
            remedy="Sort the rows, and remove those that come twice",
        )


def _refuse_long(path: str, named: str, times: Array) -> None:
    """Refuse times of which no shot can have the frames; they are mostly those of a clock that counts nanoseconds."""
    length, step = float(times[-1] - times[0]), float(np.median(np.diff(times)))
    if length > _LONGEST:
        unit = "ns" if step > 1e5 else "us" if step > 1e2 else "ms"
        raise ShotError(
            "the motion is too long",
            path=path,
            attribute=named,
            found=f"{length:.4g} s in {len(times)} rows, {step:.4g} s apart",
            remedy=f"Write times in seconds; if they are {_UNITS[unit]}, read them with --set motion.read.times={unit}",
        )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
