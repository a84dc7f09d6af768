"""Tables of text: their cells, and which columns are times, by names: `time_s`, `Time (ms)`, `header.stamp.secs`."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from calmotion.arrays import Array

TIME_UNITS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_WORDS = {
    "s": "s sec secs second seconds",
    "ms": "ms msec msecs millis millisec millisecs millisecond milliseconds",
    "us": "us usec usecs \u00b5s \u03bcs micros microsec microsecs microsecond microseconds",
    "ns": "ns nsec nsecs nanos nanosec nanosecs nanosecond nanoseconds",
}
_UNIT_OF = {word: unit for unit, words in _WORDS.items() for word in words.split()}
_TIMES = set("t time times ts timestamp timestamps stamp stamps clock elapsed timecode date datetime".split())
_BESIDE = set(
    "header field ros rosbag bag sim simulation wall system log since start epoch unix data msg in of the "
    "robot relative rel absolute abs measured elapsed gps utc host device recording".split()
)
_COUNTERS = set("frame frames index idx step row sample seq sequence tick count no nr id unnamed field header".split())
_PARTS = set("episode task chunk subtask".split())  # of a data set, which number a whole recording (LeRobot)
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_CLOCK_TIME = re.compile(
    r"(?:(?P<day>\S+)(?:T| +))?(?P<h>\d{1,2}):(?P<m>\d{2}):(?P<s>\d{2}(?:[.,]\d+)?)(?: ?(?P<zone>Z|[+-][\d:]+))?"
)
_WORD = re.compile(r"[A-Z]?[a-z\u00b5\u03bc]+|[A-Z]+(?![a-z])")
_CLOCK = 1e-6  # rounding of stamps since 1970 as floating-point numbers [s]
# Units by the least time since 1970, of recordings after 1973, and by the least step between rows that no motion has in
# the next longer unit; the first that fits counts.
_BY_SIZE = (("ns", 1e17, 3e5), ("us", 1e14, 500.0), ("ms", 1e11, np.inf))


@dataclass(frozen=True, eq=False)
class TimeColumn:
    """The times of a table.

    Attributes:
        names: The columns, of which a second one has nanoseconds beside whole seconds.
        values: Shape [n], in the unit.
        unit: `s`, `ms`, `us` or `ns`.
        named: Whether the name says it; else the values do.
    """

    names: tuple[str, ...]
    values: Array
    unit: str
    named: bool


def separator_of(head: str) -> str:
    """What is between the cells of a table, by the line with their names: a comma, a semicolon, a tab, or spaces."""
    found = max(",;\t", key=head.count)
    return found if found in head or " " not in head.strip() else " "


def number_of(cell: str, separator: str) -> float:
    """The number in a cell, which may have a decimal comma: between commas it is quoted, and must not be a thousand.

    Raises:
        ValueError: It is none.
    """
    text = cell.strip()
    decimal = text.count(",") == 1 and "." not in text and (separator != "," or not _THOUSANDS.fullmatch(text))
    return float(text.replace(",", ".") if decimal else text)


def instants(cells: Sequence[str]) -> Array | None:
    """Times that are written as dates or times of a day [s]; None where a cell is neither.

    Those of one day count from its midnight, in whatever order its date is written, others from 1970.
    """
    found = [_CLOCK_TIME.fullmatch(cell.strip()) for cell in cells]
    matches = [match for match in found if match is not None]
    if not matches or len(matches) < len(found):
        return None
    seconds = [3600.0 * int(m["h"]) + 60.0 * int(m["m"]) + float(m["s"].replace(",", ".")) for m in matches]
    days: dict[str, float] = {}
    for match in matches:
        if match["day"] not in days:
            try:
                day = datetime.fromisoformat((match["day"] or "").replace("/", "-")).replace(tzinfo=UTC)
            except ValueError:
                day = None
            days[match["day"]] = np.nan if day is None else day.timestamp()
    if len(days) == 1:
        return np.array(seconds)
    told = np.array([days[match["day"]] for match in matches])
    return None if np.isnan(told).any() else told + np.array(seconds)


def time_column(columns: Mapping[str, Array]) -> TimeColumn | None:
    """The times of a table whose columns are numbers; None where no name is that of times.

    Of several the first that increases counts: a header's stamp before the time at which a row was written.
    """
    found = {name: unit for name in columns if (unit := _unit_of_times(name)) is not None}
    for name, unit in found.items():
        pair = next((n for n, u in found.items() if (unit, u) == ("s", "ns") and _stem(n) == _stem(name)), None)
        if pair is not None and _are_whole(columns[name]):
            return TimeColumn((name, pair), columns[name] - columns[name][:1] + 1e-9 * columns[pair], "s", True)
    names = sorted(found, key=lambda name: "stamp" not in _words(name) or "header" not in _words(name))
    rising = [name for name in names if len(columns[name]) > 1 and np.all(np.diff(columns[name]) > 0.0)]
    for name in rising or names:
        unit = found[name]
        return TimeColumn((name,), columns[name], unit or _unit_of_values(columns[name]), bool(unit))
    return None


def names_times(name: str) -> bool:
    """Whether a column of this name has times."""
    return _unit_of_times(name) is not None


def counters(columns: Mapping[str, Array]) -> list[str]:
    """Columns that number the rows: named so, or not at all, and one more in each row; and those that number a
    recording, the same in all rows."""
    return [name for name, values in columns.items() if len(values) > 1 and _numbers(name, np.diff(values))]


def _numbers(name: str, steps: Array) -> bool:
    words = set(_words(name))
    part = bool(words & _PARTS) and words <= _PARTS | _COUNTERS
    return bool(np.all(steps == 0.0)) if part else words <= _COUNTERS and bool(np.all(steps == 1.0))


def _words(name: str) -> list[str]:
    return [word.lower() for word in _WORD.findall(name)]


def _stem(name: str) -> list[str]:
    return _words(name)[:-1]


def _unit_of_times(name: str) -> str | None:
    """The unit that the name of a column of times has, empty where it has none; None for other columns."""
    words = _words(name)
    unit = _UNIT_OF.get(words[-1], "") if words else ""
    rest = words[:-1] if unit else words
    if not set(rest) <= _TIMES | _BESIDE:
        return None
    if set(rest) & _TIMES:
        return unit
    return unit if unit and not rest and len(words[0]) > 2 else None


def _are_whole(values: Array) -> bool:
    return bool(np.all(values == np.round(values)))


def _unit_of_values(values: Array) -> str:
    """The unit of times whose name has none: by the years since 1970 that they are, or by their steps."""
    if len(values) < 2:
        return "s"
    first, step = abs(float(values[0])), float(np.median(np.abs(np.diff(values))))
    return next((unit for unit, epoch, least in _BY_SIZE if first >= epoch or step >= least), "s")


def exact_step(printed: str) -> float:
    """The time between frames [s] of which a printed one is a rounding: that of a whole rate, or of a whole rate over
    1.001; else as it is printed."""
    step = float(printed)
    least = 0.5 * 10.0 ** -_decimals(printed)
    rates = [round(1.0 / step), round(1.001 / step) / 1.001] if step > 0.0 else []
    fitting = [1.0 / rate for rate in rates if rate > 0 and abs(1.0 / rate - step) <= least]
    return fitting[0] if fitting else step


def exact_times(times: Array) -> Array:
    """Times of even rows [s] from 0 on, of which the given ones are roundings to decimals; else the given ones."""
    count = len(times) - 1
    if count < 1 or not times[-1] > times[0]:
        return times
    rate = count / float(times[-1] - times[0])
    for whole in (round(rate), round(1.001 * rate) / 1.001):
        even = np.arange(count + 1) / whole if whole > 0 else times
        off = float(np.abs(times - times[0] - even).max())
        if off <= _CLOCK or any(
            off <= 1.01 * 10.0**-d and np.abs(times * 10.0**d - np.round(times * 10.0**d)).max() < 1e-6
            for d in (2, 3, 4, 5, 6)
        ):
            return even
    return times


def _decimals(printed: str) -> int:
    digits, _, power = printed.strip().lower().partition("e")
    return len(digits.partition(".")[2]) - int(power or 0)
