"""Units of the columns of a table: in brackets behind their names, or in a row below them."""

import re
from collections.abc import Sequence

from calmotion.support import names_times

TIME = "time_s"
_BRACKETS = re.compile(r"(?P<name>.+?)\s*[\[(](?P<unit>[^\[\]()]+)[\])]")
_SPELLINGS = {"rad": "rad radian radians", "deg": "deg degree degrees \u00b0", "m": "m", "cm": "cm", "mm": "mm"}
_UNITS = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()}


def are_units(cells: Sequence[str]) -> bool:
    """Whether a row below the names has the units of the columns."""
    units = [_unit(cell) for cell in cells]
    return any(units) and all(not unit or unit in _UNITS or _is_of_times(unit) for unit in units)


def _is_of_times(unit: str) -> bool:
    return unit.isalpha() and names_times(f"t [{unit}]")


def with_unit(name: str, cell: str) -> str:
    """The name of a column with the unit below it, in brackets, where it has none."""
    unit = _unit(cell)
    has_one = name == "-" or _BRACKETS.fullmatch(name) or (name, unit) == (TIME, "s")
    return name if has_one or not unit else f"{name} [{unit}]"


def _unit(cell: str) -> str:
    return cell.strip().strip("[]()").lower()


def named_unit(name: str) -> tuple[str, str]:
    """A name without the unit of angles or lengths in brackets behind it, and that unit; a column of times keeps its
    own."""
    match = _BRACKETS.fullmatch(name)
    unit = None if match is None or names_times(name) else _UNITS.get(match["unit"].strip().lower())
    return (name, "") if match is None or unit is None else (match["name"].strip(), unit)
