"""Quantities as people write them: `5mm`, `30 deg`, `2.1GPa`."""

from __future__ import annotations

import math
import re
from decimal import Decimal, InvalidOperation, Overflow
from numbers import Real

from calmotion.host.errors import SettingError
from calmotion.support.naming import nearest

# Unit -> (base unit, size in base units). Decimals, so that `5mm` is exactly the float 0.005.
_UNITS = {
    "": ("", Decimal(1)),
    "m": ("m", Decimal(1)),
    "cm": ("m", Decimal("0.01")),
    "mm": ("m", Decimal("0.001")),
    "um": ("m", Decimal("0.000001")),
    "rad": ("rad", Decimal(1)),
    "deg": ("rad", Decimal(repr(math.pi)) / 180),
    "s": ("s", Decimal(1)),
    "ms": ("s", Decimal("0.001")),
    "us": ("s", Decimal("0.000001")),
    "Hz": ("Hz", Decimal(1)),
    "kHz": ("Hz", Decimal(1000)),
    "Pa": ("Pa", Decimal(1)),
    "kPa": ("Pa", Decimal(1000)),
    "MPa": ("Pa", Decimal(10**6)),
    "GPa": ("Pa", Decimal(10**9)),
}
_LONGEST = 60  # characters of what is no number that an error shows
_QUANTITY = re.compile(r"\s*([+-]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|inf))\s*([A-Za-z]*)\s*")
_MICRO = str.maketrans("\u00b5\u03bc", "uu")  # the sign, and the Greek letter


def is_unit(unit: str) -> bool:
    """Whether `unit` is one that `parse_quantity` knows; the empty string is a number without a unit."""
    return unit in _UNITS


def has_no_unit(text: str) -> bool:
    """Whether a text is a number without a unit."""
    match = _matched(text)
    return match is not None and not match[2]


def parse_quantity(text: str, unit: str = "") -> float:
    """The number that `text` means.

    Args:
        text: A number, with or without a unit of the same kind as `unit`.
        unit: Unit of a number that has none, and of what is returned.

    Returns:
        The value in `unit`.

    Raises:
        SettingError: When `text` is not a number, or its unit is unknown or of another kind.
    """
    match = _matched(text)
    base, size = _UNITS[unit]
    alike = ", ".join(name for name, (kind, _) in _UNITS.items() if kind == base and name)
    remedy = f"Write a number, or one with a unit ({alike})." if alike else "Write a number without a unit."
    likely = match and nearest(match[2], [name for name, (kind, _) in _UNITS.items() if kind == base and name])
    if not match:
        raise SettingError("this is not a number", found=_short(text), remedy=remedy)
    number, written = match.groups()
    if written not in _UNITS or (written and _UNITS[written][0] != base):
        raise SettingError("this unit does not fit", found=_short(text), remedy=f"{likely}{remedy}")
    try:
        return float(Decimal(number) * _UNITS[written or unit][1] / size)
    except (InvalidOperation, Overflow) as error:
        raise SettingError(
            "this number is beyond what can be represented", found=_short(text), remedy=remedy
        ) from error


def quantity_of(value: float | str | None, unit: str, name: str = "") -> float | None:
    """A quantity in SI; None where none is given.

    Args:
        value: A number, or a text with a unit. A bare length in a text is refused, as in the command line: most are
            meant in millimetres.
        unit: `m`, `s` or `rad`.

    Raises:
        SettingError: It is neither, not finite, or a text that does not fit.
    """
    if isinstance(value, str):
        if unit == "m" and has_no_unit(value):
            raise SettingError(
                "this length has no unit", path=name, found=value, remedy=f"Write {value}mm or {value}m."
            )
        value = parse_quantity(value, unit)
    elif value is not None and (isinstance(value, bool) or not isinstance(value, Real)):
        raise SettingError(
            "must be a number or a text", path=name, found=repr(value),
            remedy=f"Write a number, in {unit}, or a text with a unit.",
        )  # fmt: skip
    if value is not None and not math.isfinite(value):
        raise SettingError("must be finite", path=name, found=value, remedy="Write another number, or leave it out.")
    return None if value is None else float(value)


def _matched(text: str) -> re.Match[str] | None:
    """The number and the unit of a text; micro is u."""
    return _QUANTITY.fullmatch(text.translate(_MICRO))


def _short(text: str) -> str:
    return repr(text) if len(text) <= _LONGEST else f"{text[:_LONGEST]!r}, and {len(text) - _LONGEST} more characters"
