"""Typed properties of operators: units, ranges, descriptions, and the values a run gives them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from calmotion.host.errors import PluginError, SettingError
from calmotion.host.units import has_no_unit, is_unit, parse_quantity
from calmotion.support.naming import nearest

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
        unit: Unit of the value (one of `units.py`), empty for a number without one.
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
            raise PluginError(f"property {self.name} has a unit that is not known", found=repr(self.unit))
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
