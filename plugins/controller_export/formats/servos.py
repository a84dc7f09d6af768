"""Servos: how the ticks of each motor are read from a TOML file."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from calmotion.errors import ShotError, raise_all
from calmotion.support import nearest, read_toml

from ..commands import MotorCurves

_REMEDY = (
    "Write a table for each motor, such as [shoulder] with resolution = 4096 (ticks a turn), centre = 2048, "
    "direction = 1, minimum = 0 and maximum = 4095"
)
_EXAMPLE = "--set export.ticks.motors=servos.toml"
_KNOWN = ("id", "resolution", "centre", "direction", "minimum", "maximum", "offset")


@dataclass(frozen=True)
class Servo:
    """How one servo counts.

    Attributes:
        name: Of the motor's joint.
        id: Its address, or None.
        resolution: Ticks of a whole turn, or of a metre.
        centre: Ticks at angle `offset`.
        direction: 1, or -1 where the servo counts against the joint.
        minimum, maximum: Ticks that it takes.
        offset: Angle of the joint at the centre [rad or m].
    """

    name: str
    id: int | None
    resolution: float
    centre: float
    direction: int
    minimum: int
    maximum: int
    offset: float

    def ticks_per(self, linear: bool) -> float:
        """Ticks of a radian or a metre, with the sign of the direction."""
        return self.direction * self.resolution / (1.0 if linear else 2.0 * math.pi)


def read_servos(file: str, curves: MotorCurves) -> tuple[Servo, ...]:
    """The servos of the motors, in their order.

    A table is named after the joint or its prim path; the table `default` has what the others leave out. Offsets are in
    degrees, or in metres of a linear motor.

    Raises:
        ShotError: The file is missing, not TOML, or has not all of the motors.
    """
    if not file:
        raise ShotError(
            "no servos are named for the ticks", attribute="export.ticks.motors", remedy=f"Use {_EXAMPLE}. {_REMEDY}"
        )
    tables = motor_tables(file, curves, _KNOWN, _REMEDY, more=("default",))
    named = list(zip(curves.motors, curves.names, strict=True))
    without = [name for motor, name in named if not {motor.path, name, "default"} & set(tables)]
    if without:
        raise ShotError("motors without servos", path=file, found=", ".join(without), remedy=_REMEDY)
    default = tables.get("default", {})
    return tuple(
        _servo(file, name, default | tables.get(motor.path, tables.get(name, {})), motor.linear)
        for motor, name in named
    )


def motor_tables(
    file: str, curves: MotorCurves, entries: Sequence[str], remedy: str, more: Sequence[str] = ()
) -> dict[str, dict[str, Any]]:
    """The tables of a TOML file, each named after a joint or its prim path.

    Args:
        file: The file.
        curves: Of the motors.
        entries: That a table may have.
        remedy: Of what does not fit.
        more: Names of tables of no motor.

    Raises:
        ShotError: The file is missing, not TOML, or has a table of no motor or an entry that is none.
    """
    try:
        tables: dict[str, dict[str, Any]] = read_toml(file)
    except (OSError, ValueError) as error:
        found = error.strerror if isinstance(error, OSError) else error
        raise ShotError("the file of the motors cannot be read", path=file, found=found, remedy=remedy) from error
    known = sorted({*more, *curves.names, *(motor.path for motor in curves.motors)})
    problems = []
    for name, table in tables.items():
        if name not in known:
            near = nearest(name, known)
            problems.append(ShotError("no motor has this name", path=file, attribute=name, found=name, remedy=near))
        elif not isinstance(table, dict):
            problems.append(ShotError("must be a table", path=file, attribute=name, found=table, remedy=remedy))
        for key in sorted(set(table) - set(entries)) if isinstance(table, dict) else ():
            told = f"{nearest(key, entries)}Use {', '.join(entries)}"
            place = f"{name}.{key}"
            problems.append(ShotError("there is no such entry", path=file, attribute=place, found=key, remedy=told))
    raise_all(problems)
    return tables


def number_of(file: str, name: str, table: dict[str, Any], key: str, default: float | None, remedy: str) -> float:
    """A number of the table of a motor.

    Raises:
        ShotError: It is none.
    """
    value = table.get(key, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ShotError("must be a number", path=file, attribute=f"{name}.{key}", found=value, remedy=remedy)
    return float(value)


def _servo(file: str, name: str, table: dict[str, Any], linear: bool) -> Servo:
    def number(key: str, default: float | None = None) -> float:
        return number_of(file, name, table, key, default, _REMEDY)

    resolution = number("resolution")
    centre = number("centre", 0.5 * resolution)
    direction, low = number("direction", 1), number("minimum", 0)
    high = number("maximum", resolution - 1)
    wrong = {"resolution": resolution <= 0.0, "direction": abs(direction) != 1.0, "maximum": high <= low}
    for key in (key for key, found in wrong.items() if found):
        raise ShotError("is out of range", path=file, attribute=f"{name}.{key}", found=table.get(key), remedy=_REMEDY)
    return Servo(
        name=name,
        id=int(number("id")) if "id" in table else None,
        resolution=resolution,
        centre=centre,
        direction=int(direction),
        minimum=int(low),
        maximum=int(high),
        offset=number("offset", 0.0) * (1.0 if linear else math.radians(1.0)),
    )
