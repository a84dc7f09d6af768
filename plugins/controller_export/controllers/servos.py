"""Servos: how the ticks of each motor are read from a TOML file."""

from __future__ import annotations

import math
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
    try:
        tables = read_toml(file)
    except (OSError, ValueError) as error:
        found = error.strerror if isinstance(error, OSError) else error
        raise ShotError("the servos cannot be read", path=file, found=found, remedy=_REMEDY) from error
    paths = [motor.path for motor in curves.motors]
    known = {*paths, *curves.names, "default"}
    problems = [
        ShotError("no motor has this name", path=file, attribute=name, found=name, remedy=nearest(name, sorted(known)))
        for name in tables
        if name not in known
    ]
    named = list(zip(curves.motors, curves.names, strict=True))
    without = [name for motor, name in named if not {motor.path, name, "default"} & set(tables)]
    if without:
        missing = ShotError("motors without servos", path=file, found=", ".join(without), remedy=_REMEDY)
        raise_all([*problems, missing])
    servos = []
    default = _table(file, "default", tables.get("default", {}))
    for motor, name in named:
        try:
            own = _table(file, name, tables.get(motor.path, tables.get(name, {})))
            servos.append(_servo(file, name, default | own, motor.linear))
        except ShotError as error:
            problems.append(error)
    raise_all(problems)
    return tuple(servos)


def _table(file: str, name: str, table: Any) -> dict[str, Any]:
    if not isinstance(table, dict):
        raise ShotError("must be a table", path=file, attribute=name, found=table, remedy=_REMEDY)
    wrong = next((key for key in table if key not in _KNOWN), None)
    if wrong is not None:
        raise ShotError(
            "there is no such entry of a servo", path=file, attribute=f"{name}.{wrong}", found=wrong,
            remedy=f"{nearest(wrong, _KNOWN)}Use {', '.join(_KNOWN)}",
        )  # fmt: skip
    return table


def _servo(file: str, name: str, table: dict[str, Any], linear: bool) -> Servo:
    def number(key: str, default: float | None = None) -> float:
        value = table.get(key, default)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise ShotError("must be a number", path=file, attribute=f"{name}.{key}", found=value, remedy=_REMEDY)
        return float(value)

    resolution = number("resolution")
    centre = number("centre", 0.5 * resolution)
    direction, low = number("direction", 1), number("minimum", 0)
    high = number("maximum", resolution - 1)
    for key, wrong, value in (
        ("resolution", resolution <= 0.0, resolution), ("direction", abs(direction) != 1.0, direction),
        ("maximum", high <= low, high),
    ):  # fmt: skip
        if wrong:
            raise ShotError("is out of range", path=file, attribute=f"{name}.{key}", found=value, remedy=_REMEDY)
    offset = number("offset", 0.0)
    address = table.get("id")
    return Servo(
        name, None if address is None else int(number("id")), resolution, centre, int(direction), int(low), int(high),
        offset if linear else math.radians(offset),
    )  # fmt: skip
