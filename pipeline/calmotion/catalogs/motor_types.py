"""Real motors by name: the table that is shipped, and those of the user; numbers in SI, a source for each.

A motor of a table turns a joint, or moves it along its axis (`linear`). Tables have the units of data sheets.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from calmotion.errors import ShotError, raise_all
from calmotion.support.caching.cache_folder import configuration_folder
from calmotion.support.foreign_files import read_toml
from calmotion.support.naming import nearest

TABLE = Path(__file__).with_suffix(".toml")
FILE_NAME = "motors.toml"  # of the user, in the configuration folder
GROUPS = ("smart servo", "hobby servo", "strain wave actuator", "robot joint", "other")
_REMEDY = "`calmotion motors NAME --toml` prints an example"


class Quantity(NamedTuple):
    """A number of a motor: unit in tables and its size in SI, for one that turns and for one that is linear.

    Attributes:
        title: For people.
        si: Units in SI.
        positive: Whether it may not be zero.
    """

    title: str
    unit: str
    factor: float
    si: str
    linear_unit: str
    linear_si: str
    positive: bool = False


_TURN = math.pi / 30.0  # rev/min in rad/s
QUANTITIES = {
    "max_torque": Quantity("largest torque", "N m", 1.0, "N m", "N", "N", True),
    "no_load_speed": Quantity("no-load speed", "rev/min", _TURN, "rad/s", "m/s", "m/s", True),
    "torque_speed_knee": Quantity("knee of torque over speed, share of the no-load speed", "", 1.0, "", "", ""),
    "max_speed": Quantity("largest speed", "rev/min", _TURN, "rad/s", "m/s", "m/s", True),
    "armature": Quantity("inertia of the rotor, at the joint", "kg m^2", 1.0, "kg m^2", "kg", "kg"),
    "gear_stiffness": Quantity("stiffness of the gear", "N m/rad", 1.0, "N m/rad", "N/m", "N/m", True),
    "gear_damping": Quantity("damping of the gear", "N m s/rad", 1.0, "N m s/rad", "N s/m", "N s/m"),
    "friction": Quantity("Coulomb friction", "N m", 1.0, "N m", "N", "N"),
    "friction_speed": Quantity(
        "speed within which friction changes its sign", "deg/s", math.pi / 180.0, "rad/s", "m/s", "m/s", True
    ),
    "viscous_friction": Quantity("viscous friction", "N m s/rad", 1.0, "N m s/rad", "N s/m", "N s/m"),
    "position_gain": Quantity("position gain", "N m/rad", 1.0, "N m/rad", "N/m", "N/m", True),
    "velocity_gain": Quantity("velocity gain", "N m s/rad", 1.0, "N m s/rad", "N s/m", "N s/m"),
    "torque_constant": Quantity("torque constant, at the joint", "N m/A", 1.0, "N m/A", "N/A", "N/A", True),
    "resistance": Quantity("resistance of the winding", "ohm", 1.0, "ohm", "ohm", "ohm", True),
    "delay": Quantity("delay", "s", 1.0, "s", "s", "s"),
    "backlash": Quantity("backlash, end to end", "deg", math.pi / 180.0, "rad", "m", "m"),
    "stribeck": Quantity("Stribeck friction", "N m", 1.0, "N m", "N", "N"),
    "stribeck_speed": Quantity("Stribeck speed", "deg/s", math.pi / 180.0, "rad/s", "m/s", "m/s", True),
    "stribeck_exponent": Quantity("Stribeck exponent", "", 1.0, "", "", "", True),
    "load": Quantity("friction per torque of the gear", "", 1.0, "", "", ""),
    "stribeck_load": Quantity("Stribeck friction per torque of the gear", "", 1.0, "", "", ""),
    "motor_load": Quantity("friction per torque of the motor", "", 1.0, "", "", ""),
    "joint_load": Quantity("friction per torque of the joint", "", 1.0, "", "", ""),
    "stribeck_motor_load": Quantity("Stribeck friction per torque of the motor", "", 1.0, "", "", ""),
    "stribeck_joint_load": Quantity("Stribeck friction per torque of the joint", "", 1.0, "", "", ""),
    "motor_quadratic": Quantity("friction per squared torque, motor drives", "1/(N m)", 1.0, "1/(N m)", "1/N", "1/N"),
    "joint_quadratic": Quantity("friction per squared torque, joint drives", "1/(N m)", 1.0, "1/(N m)", "1/N", "1/N"),
}


@dataclass(frozen=True)
class MotorType:
    """A real motor.

    Attributes:
        name: Its own name in its table.
        values: SI, by the names of `QUANTITIES`; what is not known is not there.
        sources: Of each of these values.
        linear: Whether it moves along an axis instead of turning.
        title: What it is, for people.
        group: One of `GROUPS`.
        aliases: Other names.
        law: Name of the law of its friction; empty: Coulomb's.
    """

    name: str
    values: Mapping[str, float]
    sources: Mapping[str, str]
    linear: bool = False
    title: str = ""
    group: str = "other"
    aliases: tuple[str, ...] = ()
    law: str = ""

    def get(self, quantity: str, fallback: float) -> float:
        """A value in SI, or the fallback where it is not known."""
        return self.values.get(quantity, fallback)

    def in_table(self, quantity: str) -> float:
        """A value in the unit that its table has."""
        found = QUANTITIES[quantity]
        return self.values[quantity] / (1.0 if self.linear else found.factor)

    def unit(self, quantity: str) -> str:
        """The unit of a value in its table."""
        found = QUANTITIES[quantity]
        return found.linear_unit if self.linear else found.unit


@dataclass(frozen=True)
class _Table:
    """One table of a file, while it is read."""

    file: str
    name: str
    problems: list[ShotError] = field(default_factory=list)

    def wrong(self, problem: str, key: str, found: Any, remedy: str = "") -> None:
        """Note a problem with a value."""
        self.problems.append(
            ShotError(problem, path=self.file, attribute=f"{self.name}.{key}", found=found, remedy=f"{remedy}{_REMEDY}")
        )


def motor_types(files: Iterable[str | Path] = ()) -> dict[str, MotorType]:
    """The motors by name: those that are shipped, those of the configuration folder, and those of given files; later
    ones replace earlier ones of the same name.

    Args:
        files: TOML files with a table for each motor.

    Raises:
        ShotError: A file cannot be read, or something in it is wrong.
    """
    own = configuration_folder() / FILE_NAME
    found = dict(_shipped())
    for file in (*([own] if own.is_file() else []), *files):
        found |= read_motor_types(file)
    return found


def motor_type_named(name: str, known: Mapping[str, MotorType]) -> MotorType | None:
    """A motor by its name or another name of it, upper case and separators apart; None where there is none."""
    wanted = _plain(name)
    return next((found for own, found in known.items() if wanted in map(_plain, (own, *found.aliases))), None)


def likely_motor_types(name: str, known: Mapping[str, MotorType]) -> str:
    """What to write instead of a name that no motor has."""
    names = [*known, *(alias for found in known.values() for alias in found.aliases)]
    near = nearest(name, names)
    return f"{near}`calmotion motors` lists them; add your own to {configuration_folder() / FILE_NAME}"


def read_motor_types(file: str | Path) -> dict[str, MotorType]:
    """The motors of a TOML file.

    Raises:
        ShotError: It cannot be read, or something in it is wrong.
    """
    try:
        tables = read_toml(file)
    except (OSError, ValueError) as error:
        found = error.strerror if isinstance(error, OSError) else error
        raise ShotError("the motors cannot be read", path=str(file), found=found, remedy=_REMEDY) from error
    problems: list[ShotError] = []
    read: dict[str, MotorType] = {}
    for name, table in tables.items():
        read[name] = _motor_type(_Table(str(file), name, problems), table)
    raise_all(problems)
    return read


def _motor_type(at: _Table, table: Any) -> MotorType:
    """One motor; what is wrong is added to the problems."""
    if not isinstance(table, dict):
        at.problems.append(ShotError("must be a table", path=at.file, attribute=at.name, found=table, remedy=_REMEDY))
        return MotorType(at.name, {}, {})
    texts, linear = ("title", "group", "friction_model"), table.get("linear", False)
    if not isinstance(linear, bool):
        at.wrong("must be true or false", "linear", linear)
    values = {}
    for key, value in table.items():
        if key in QUANTITIES:
            values[key] = _value(at, key, value, linear is True)
        elif key in texts and not isinstance(value, str):
            at.wrong("must be a text", key, value)
        elif key == "aliases" and not _are_texts(value):
            at.wrong("must be a list of texts", key, value)
        elif key not in (*texts, "aliases", "linear", "sources"):
            at.wrong("there is no such property of a motor", key, value, nearest(key, QUANTITIES))
    return MotorType(
        at.name, values, _sources(at, table.get("sources", {}), values), linear is True,
        str(table.get("title", at.name)), str(table.get("group", "other")), tuple(map(str, table.get("aliases", ()))),
        str(table.get("friction_model", "")),
    )  # fmt: skip


def _value(at: _Table, key: str, value: Any, linear: bool) -> float:
    """A number of a table, SI."""
    quantity = QUANTITIES[key]
    unit = quantity.linear_unit if linear else quantity.unit
    number = value if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan
    least = number > 0.0 if quantity.positive else number >= 0.0
    if not (least and math.isfinite(number)):
        kind = "a positive number" if quantity.positive else "a number that is not negative"
        at.wrong(f"must be {kind}{f' [{unit}]' if unit else ''}", key, value)
    elif key == "torque_speed_knee" and not number < 1.0:
        at.wrong("must be a share of the no-load speed below 1", key, value)
    return float(number) * (1.0 if linear else quantity.factor)


def _sources(at: _Table, given: Any, values: Mapping[str, float]) -> dict[str, str]:
    """The source of each value: that of the table whose name has it, else the user."""
    if not (isinstance(given, dict) and _are_texts(list(given.values()))):
        at.wrong("must be a table of texts", "sources", given)
        return {}
    found = dict.fromkeys(values, "the user")
    for names, source in given.items():
        for name in names.split():
            if name not in values:
                at.wrong("a source for a value that is not there", f"sources.{names}", name, nearest(name, values))
            found[name] = source
    return found


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, str) for item in value)


def _plain(name: str) -> str:
    return name.strip().lower().replace("_", "-").replace(" ", "-")


@cache
def _shipped() -> dict[str, MotorType]:
    return read_motor_types(TABLE)
