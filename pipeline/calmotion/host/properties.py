"""Typed properties of operators: quantities as people write them, ranges, descriptions, and values of a run."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation, Overflow
from numbers import Real
from typing import Any

from calmotion.host.errors import PluginError, SettingError
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
            "must be a number or a text",
            path=name,
            found=repr(value),
            remedy=f"Write a number, in {unit}, or a text with a unit.",
        )
    if value is not None and not math.isfinite(value):
        raise SettingError("must be finite", path=name, found=value, remedy="Write another number, or leave it out.")
    return None if value is None else float(value)


def _matched(text: str) -> re.Match[str] | None:
    """The number and the unit of a text; micro is u."""
    return _QUANTITY.fullmatch(text.translate(_MICRO))


def _short(text: str) -> str:
    return repr(text) if len(text) <= _LONGEST else f"{text[:_LONGEST]!r}, and {len(text) - _LONGEST} more characters"


_AUTOMATIC = ("auto", "-1", "-1.0")
_WORDS = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
_BOOLEANS = {"true": True, "yes": True, "on": True, "1": True, "false": False, "no": False, "off": False, "0": False}


@dataclass(frozen=True)
class Property:
    """One property of an operator.

    Attributes:
        name: Python name; set as `<operator idname>.<name>`.
        kind: `float`, `int`, `bool` or `str`.
        default: Value when nobody sets it, always allowed, also outside the range; None for a number that is optional:
            `auto` then leaves it to the operator.
        unit: Unit of the value (one of `_UNITS`), empty for a number without one.
        minimum, maximum: Range, bounds included; None: open.
        choices: The allowed strings; empty: any.
        description: One sentence for the user.
    """

    name: str
    kind: type
    default: Any
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    description: str = ""

    def read(self, value: object) -> Any:
        """`value` as this property's type, from a string (`5mm`) or from a typed value; None of an optional one that is
        left to the operator, by `auto`, or by -1 as in earlier settings.

        Raises:
            SettingError: When the value has the wrong type, unit or range.
        """
        if self.default is None and (value is None or str(value).strip() in _AUTOMATIC):
            return None
        read = self._parse(value) if isinstance(value, str) and self.kind is not str else self._convert(value)
        if read != self.default:
            self._check_range(read)
        return read

    def _parse(self, text: str) -> Any:
        if self.kind is bool:
            if text.strip().lower() not in _BOOLEANS:
                raise SettingError("this is neither true nor false", found=repr(text), remedy="Write true or false.")
            return _BOOLEANS[text.strip().lower()]
        value = self._convert(parse_quantity(text, self.unit))
        # a bare length is mostly in millimetres, or in the unit of the stage; -1 and the like have no unit
        if self.unit == "m" and has_no_unit(text) and value > 0.0:
            number = text.strip()
            raise SettingError(
                "this length has no unit", found=repr(text), remedy=f"Write {number}m or {number}mm, whichever it is."
            )
        return value

    def _convert(self, value: object) -> Any:
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if self.kind is float and number:
            return float(value)  # type: ignore[arg-type]
        if self.kind is int and number and math.isfinite(value) and value == int(value):  # type: ignore[arg-type, call-overload]
            return int(value)  # type: ignore[call-overload]
        if self.kind in (bool, str) and isinstance(value, self.kind):
            return value
        raise SettingError("the value has the wrong type", found=repr(value), remedy=f"Write {_WORDS[self.kind]}.")

    def _check_range(self, value: Any) -> None:
        if self.choices and value not in self.choices:
            raise SettingError(
                "this is not one of the choices",
                found=repr(value),
                remedy=f"{nearest(str(value), self.choices)}Choose one of {', '.join(self.choices)}.",
            )
        if self.kind in (bool, str):
            return
        low = self.minimum is not None and not value >= self.minimum
        high = self.maximum is not None and not value <= self.maximum
        if low or high or not math.isfinite(value):
            bound = self.minimum if low or value != value else self.maximum
            near = "" if bound is None else f"The nearest allowed one is {bound:g}{f' {self.unit}' * bool(self.unit)}. "
            raise SettingError(
                "the value is out of range", found=value, remedy=f"{near}Choose a value {self.range_text()}."
            )

    def range_text(self) -> str:
        """The range as text, such as `from 0 to 1 m`; empty when there is none."""
        bounds = [] if self.minimum is None else [f"from {self.minimum:g}"]
        bounds += [] if self.maximum is None else [f"up to {self.maximum:g}"]
        return " ".join([*bounds, self.unit] if bounds and self.unit else bounds)

    def check(self) -> None:
        """Check the declaration itself.

        Raises:
            PluginError: When the declaration cannot be right; the message says why.
        """
        if not (isinstance(self.name, str) and self.name.isidentifier()):
            raise PluginError("a property's name must be a Python name", found=repr(self.name))
        if self.kind not in (float, int, bool, str):
            raise PluginError(f"property {self.name} must be float, int, bool or str", found=self.kind)
        if not is_unit(self.unit) or (self.unit and self.kind not in (float, int)):
            known = ", ".join(unit for unit in _UNITS if unit)
            raise PluginError(
                f"property {self.name} has a unit that is not known", found=repr(self.unit),
                remedy=f"Use one of {known}, of a float or an int, or none, and say it in the description.",
            )  # fmt: skip
        if self.default is None:
            if self.kind not in (float, int):
                raise PluginError(f"property {self.name} has no default", found=None)
            return
        try:
            if self.read(self.default) != self.default or isinstance(self.default, str) != (self.kind is str):
                raise PluginError(f"property {self.name} has a default of the wrong type", found=repr(self.default))
        except SettingError as error:
            raise PluginError(f"property {self.name} has a wrong default: {error}") from error


class PropertyValues(Mapping[str, Any]):
    """The values of one operator's properties, read as attributes (`context.properties.element_size`)."""

    def __init__(self, values: Mapping[str, Any]):
        self._values = dict(values)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["_values"][name]
        except KeyError:
            raise AttributeError(f"no property {name!r}; there are: {', '.join(self._values) or 'none'}") from None

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)


def values_of(properties: Iterable[Property], given: Mapping[str, object], place: str) -> PropertyValues:
    """Defaults, replaced by what was given.

    Args:
        given: Name to string or typed value.
        place: Idname of the operator, for messages.

    Raises:
        SettingError: For a name that is not declared or a value that does not fit.
    """
    declared = {p.name: p for p in properties}
    values = {name: p.read(p.default) for name, p in declared.items()}
    for name, value in given.items():
        if name not in declared:
            known = ", ".join(declared) or "none"
            raise SettingError(
                "there is no such property",
                path=f"{place}.{name}",
                remedy=f"{nearest(name, declared)}It has: {known}.",
            )
        try:
            values[name] = declared[name].read(value)
        except SettingError as error:
            raise SettingError(error.problem, path=f"{place}.{name}", found=error.found, remedy=error.remedy) from error
    return PropertyValues(values)
