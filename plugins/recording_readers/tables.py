"""Tables of recordings: named after prims, or with a TOML map of their columns."""

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError, raise_all
from calmotion.recordings import (
    ACCELEROMETER,
    ANGLE,
    COMPONENTS,
    EFFORT,
    MARKER,
    STRAIN,
    Channel,
    LowPass,
    RecordingRequest,
    SensorRecording,
    hash_of,
)
from calmotion.support import TIME_UNITS, TimeColumn, counters, nearest, time_column

from .columns import UNITS, column_of, increasing, read_columns, unit_of
from .maps import map_of, noise_in, positive, refuse_other_entries

TIME = "time_s"
SUFFIXES: Mapping[str, tuple[str, int]] = {
    ".x": (MARKER, 0), ".y": (MARKER, 1), ".z": (MARKER, 2), ".ax": (ACCELEROMETER, 0), ".ay": (ACCELEROMETER, 1),
    ".az": (ACCELEROMETER, 2), ".angle": (ANGLE, 0), ".effort": (EFFORT, 0),
}  # fmt: skip
NOT_MEASURED = (".error", ".rotation_error", ".input", ".output")  # other columns of tables that --csv wrote
BEFORE = "_before"  # end of those of the motion as animated
REACTIONS = (".force", ".moment")
FITTING = {
    MARKER: ("m", "cm", "mm", "in"),
    ACCELEROMETER: ("m/s^2", "mm/s^2", "g"),
    ANGLE: ("rad", "deg", "turn", "m", "cm", "mm"),
    EFFORT: ("N m", "N mm", "N"),
    STRAIN: ("",),
}
TIMES = ("s", "ms", "us", "ns")
DEFAULT_UNIT = {MARKER: "m", ACCELEROMETER: "m/s^2", ANGLE: "rad", EFFORT: "N m", STRAIN: ""}
KNOWN = ("prim", "to", "kind", "columns", "unit", "noise", "low_pass")
EXAMPLE = (
    'Write a table [[channel]] with prim = "/Arm/Hand/cup", kind = "marker", columns = ["x", "y", "-z"] and unit = "mm"'
)


def read_table(request: RecordingRequest, map_file: str) -> SensorRecording:
    """A recording from a table.

    Args:
        request: Its file.
        map_file: TOML map of the columns; empty: FILE.toml beside it, or none.

    Raises:
        ShotError: The table or the map cannot be read, or do not fit.
    """
    file = request.file
    if request.prim:
        raise ShotError(
            "a table names the prims of its channels itself",
            path=file,
            found=f"@{request.prim}",
            remedy=f"Name the file alone: --recording {file}",
        )
    columns, degrees = read_columns(file)
    content, beside = map_of(file, map_file, (), EXAMPLE)
    channels, notes = _named(file, columns, degrees) if content is None else _mapped(file, columns, content, beside)
    if not channels:
        raise ShotError(
            "the recording has no channel",
            path=file,
            found=", ".join(list(columns)[:12]),
            remedy=f"Name columns after prims, such as /Arm/Hand/cup.x or /Arm/Elbow.angle, or write {beside}",
        )
    return SensorRecording(file, hash_of(file), tuple(channels), tuple(notes))


def _named(file: str, columns: Mapping[str, Array], degrees: bool) -> tuple[list[Channel], list[str]]:
    """Channels of a table whose columns are named after prims."""
    own = TimeColumn((TIME,), columns[TIME], "s", True) if TIME in columns else time_column(columns)
    if own is None:
        raise ShotError(
            "the recording has no column of times",
            path=file,
            attribute=TIME,
            found=", ".join(list(columns)[:12]),
            remedy=f"Name it {TIME}, in seconds, or write a map: {os.path.splitext(os.path.basename(file))[0]}.toml",
        )
    groups: dict[tuple[str, str], dict[int, Array]] = {}
    counted = counters({name: values for name, values in columns.items() if not name.startswith("/")})
    skipped, wrong = [], []
    for name, values in columns.items():
        path, dot, suffix = name.rpartition(".")
        if name in own.names or name in counted:
            continue
        if f"{dot}{suffix}" in NOT_MEASURED or path.endswith(REACTIONS) or suffix.endswith(BEFORE):
            skipped.append(name)
        elif f"{dot}{suffix}" not in SUFFIXES or not path.startswith("/"):
            wrong.append(name)
        else:
            kind, component = SUFFIXES[f"{dot}{suffix}"]
            scale = UNITS["deg"] if kind == ANGLE and degrees else 1.0
            groups.setdefault((kind, path), {})[component] = scale * values
    raise_all(
        [
            ShotError(
                "this is no column of a recording",
                path=file,
                attribute=name,
                remedy=f"Name it PRIM.x, .y, .z, .ax, .ay, .az, .angle or .effort, or write a map. {EXAMPLE}",
            )
            for name in wrong
        ]
    )
    # seconds of the recording: those since 1970 would leave no digits for what is between two samples
    seconds = TIME_UNITS[own.unit] * (own.values - (0.0 if own.names == (TIME,) else own.values[0]))
    keep = increasing(seconds, file, own.names[0])
    channels = []
    for (kind, path), parts in groups.items():
        values = np.full((len(keep), COMPONENTS[kind]), np.nan)
        for component, column in parts.items():
            values[:, component] = column
        channels += _channel(kind, path, seconds, values, keep, None)
    notes = _notes(file, keep)
    if own.names != (TIME,):
        notes.append(f"{file}: its times are those of {' and '.join(own.names)}, in {own.unit}, from the first row on")
    if skipped:
        notes.append(f"{file}: {len(skipped)} columns are not measurements, such as {skipped[0]}; they are not read")
    return channels, notes


def _mapped(
    file: str, columns: Mapping[str, Array], content: Mapping[str, Any], map_file: str
) -> tuple[list[Channel], list[str]]:
    """Channels of a table by its map."""
    times, name = _times(columns, content, file, map_file)
    keep = increasing(times, file, name)
    tables = content.get("channel", [])
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        raise ShotError("the map has no channels", path=map_file, attribute="channel", remedy=EXAMPLE)
    channels: list[Channel] = []
    for number, table in enumerate(tables):
        place = f"channel[{number}]"
        refuse_other_entries(table, map_file, f"{place}.", KNOWN)
        kind, path, given = table.get("kind"), table.get("prim"), table.get("columns")
        if not isinstance(kind, str) or kind not in COMPONENTS:
            raise ShotError(
                "there is no such kind of channel",
                path=map_file,
                attribute=f"{place}.kind",
                found=kind,
                remedy=f"{nearest(str(kind), COMPONENTS)}Use {', '.join(COMPONENTS)}",
            )
        ends = [("prim", path)] + ([("to", table.get("to"))] if kind == STRAIN else [])
        for entry, end in ends:
            if not isinstance(end, str) or not end.startswith("/"):
                raise ShotError(
                    "must be a prim path",
                    path=map_file,
                    attribute=f"{place}.{entry}",
                    found=end,
                    remedy='Write to = "/Arm/Link/gauge_end", the other end of the gauge' if entry == "to" else EXAMPLE,
                )
        given = [given] if isinstance(given, str) else given
        if not isinstance(given, list) or len(given) != COMPONENTS[kind]:
            raise ShotError(
                f"a channel of this kind has {COMPONENTS[kind]} columns",
                path=map_file,
                attribute=f"{place}.columns",
                found=given,
                remedy=EXAMPLE,
            )
        unit = unit_of(str(table.get("unit", DEFAULT_UNIT[kind])), FITTING[kind], map_file, f"{place}.unit")
        values = unit * np.stack([column_of(columns, str(column), file) for column in given], axis=1)
        made = _channel(kind, str(path), times, values, keep, noise_in(table, unit, map_file, f"{place}."))
        low_pass = _low_pass(table.get("low_pass"), map_file, f"{place}.low_pass")
        channels += [replace(own, to=str(ends[-1][1]) if kind == STRAIN else "", low_pass=low_pass) for own in made]
    return channels, _notes(file, keep)


def _times(columns: Mapping[str, Array], content: Mapping[str, Any], file: str, map_file: str) -> tuple[Array, str]:
    """Times [s], from a column or from a rate, and the name of where they stand."""
    table = content.get("time", {"column": TIME})
    if not isinstance(table, dict):
        raise ShotError(
            "must be a table",
            path=map_file,
            attribute="time",
            found=table,
            remedy='Write [time] with column = "t" and unit = "ms", or with rate = 1000.0 (samples a second)',
        )
    if "rate" in table:
        problem, remedy = "must be a number of samples a second", "Write it in Hz, such as 1000.0"
        rate = positive(table["rate"], map_file, "time.rate", problem, remedy)
        return np.arange(len(next(iter(columns.values())))) / rate, "time.rate"
    name = str(table.get("column", TIME))
    return unit_of(str(table.get("unit", "s")), TIMES, map_file, "time.unit") * column_of(columns, name, file), name


def _low_pass(given: object, map_file: str, place: str) -> LowPass | None:
    """The filter of a channel.

    Raises:
        ShotError: It is no table of a frequency and, of second order, a damping.
    """
    if given is None:
        return None
    numbers = given if isinstance(given, dict) and {"frequency"} <= set(given) <= {"frequency", "damping"} else {"": 0}
    problem = "a filter has a frequency in Hz and, of second order, a damping"
    remedy = "Write low_pass = { frequency = 2.0, damping = 0.9 }, without damping of first order"
    found = {name: positive(value, map_file, place, problem, remedy) for name, value in numbers.items()}
    return LowPass(found["frequency"], found.get("damping"))


def _channel(kind: str, path: str, times: Array, values: Array, keep: np.ndarray, sigma: float | None) -> list[Channel]:
    """The channel of the rows that hold a sample of it; none where there is no sample."""
    rows = keep & np.isfinite(values).any(axis=1)
    return [Channel(kind, path, times[rows], values[rows], sigma)] if rows.any() else []


def _notes(file: str, keep: np.ndarray) -> list[str]:
    doubled = int((~keep).sum())
    return [f"{file}: {doubled} rows have the time of the row before them; they are not read"] if doubled else []
