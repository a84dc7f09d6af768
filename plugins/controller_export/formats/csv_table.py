"""A table of commands: comment lines that a person and a program read, then the columns."""

import csv
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
from calmotion.errors import ShotError
from calmotion.host import Property, PropertyValues
from calmotion.support import write_text

from ..command_format import CommandFormat
from ..commands import CUBIC, HOLD, LINEAR, QUINTIC, Commands, MotorCurves
from ..sampling import held_commands, smooth_commands

_DERIVATIVES = (".velocity", ".acceleration")


class CsvTable(CommandFormat):
    """A table with a header that has rate, units and limits; one row for each command."""

    idname = "export.csv"
    label = "Write a table of commands"
    format = "csv"
    suffix = ".csv"
    properties = (
        Property("angles", str, "rad", choices=("rad", "deg"), description="Unit of angles; lengths are in m"),
        Property(
            "player",
            str,
            LINEAR,
            choices=(HOLD, LINEAR, CUBIC, QUINTIC),
            description="How the player of the table interpolates; for cubic and quintic the table has velocities, for "
            "quintic accelerations as well",
        ),
        Property("digits", int, 12, minimum=1, maximum=17, description="Significant digits of the values"),
    )

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Positions at the rate, with the derivatives that the player needs."""
        if properties.player == HOLD:
            return held_commands(curves, rate)
        return smooth_commands(curves, rate, properties.player)

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write the table."""
        paths, degrees = [motor.path for motor in curves.motors], properties.angles == "deg"
        units = _units(curves, degrees)
        columns, heads = [commands.positions * units], paths
        for suffix, values in zip(_DERIVATIVES, (commands.velocities, commands.accelerations), strict=True):
            if values is not None:
                columns.append(values * units)
                heads = [*heads, *(path + suffix for path in paths)]
        lines = [*_header(curves, commands, rate, degrees), ",".join(["time_s", *heads])]
        lines += [
            ",".join([f"{time:.12g}", *(f"{value:.{properties.digits}g}" for value in row)])
            for time, row in zip(commands.times, np.hstack(columns), strict=True)
        ]
        write_text(file, "\n".join(lines) + "\n")
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the table."""
        with open(files[0], encoding="utf-8", newline="") as stream:
            lines = stream.read().splitlines()
        comments = [line[2:].partition(": ") for line in lines if line.startswith("# ")]
        facts = {name: value for name, colon, value in comments if colon}
        head, *rows = csv.reader(line for line in lines if not line.startswith("#"))
        paths = [motor.path for motor in curves.motors]
        try:
            values = np.array(rows, np.float64)
            column = {name: values[:, k] for k, name in enumerate(head)}
            units = _units(curves, "angle deg" in facts["units"])
            found = [
                np.stack([column[path + suffix] for path in paths], axis=1) / units
                for suffix in ("", *_DERIVATIVES)
                if paths[0] + suffix in column
            ]
            interpolation, times = facts["player"], column["time_s"]
        except (KeyError, ValueError, IndexError) as error:
            raise ShotError("this table does not hold these commands", path=files[0], found=error) from error
        start = None
        if interpolation == HOLD:
            with suppress(KeyError, ValueError):
                start = np.array([float(text) for text in facts["start"].split(", ")]) / units
        positions, velocities, accelerations = (*found, None, None)[:3]
        return Commands(interpolation, times, positions, velocities, accelerations, start)


def _units(curves: MotorCurves, degrees: bool) -> np.ndarray:
    """What a radian, or metre, of each motor is in the table."""
    return np.array([1.0 if motor.linear or not degrees else math.degrees(1.0) for motor in curves.motors])


def _header(curves: MotorCurves, commands: Commands, rate: float, degrees: bool) -> Iterator[str]:
    angle = "deg" if degrees else "rad"
    yield f"# shot: {curves.shot}"
    yield f"# rate_hz: {rate:.12g}"
    yield f"# player: {commands.interpolation}"
    yield f"# units: time s, angle {angle}, length m, torque N m, force N"
    if commands.start is not None:
        yield f"# start: {', '.join(f'{value:.12g}' for value in commands.start * _units(curves, degrees))}"
    for k, motor in enumerate(curves.motors):
        yield f"# limits of {motor.path}: {_limits(k, curves, angle)}"


def _limits(k: int, curves: MotorCurves, angle: str) -> str:
    motor = curves.motors[k]
    unit, effort = ("m", "N") if motor.linear else (angle, "N m")
    factor = math.degrees(1.0) if unit == "deg" else 1.0
    shown = (
        ("lower", curves.limits[k, 0] * factor, unit),
        ("upper", curves.limits[k, 1] * factor, unit),
        ("velocity", motor.max_velocity * factor, f"{unit}/s"),
        ("acceleration", motor.max_acceleration * factor, f"{unit}/s^2"),
        ("jerk", motor.max_jerk * factor, f"{unit}/s^3"),
        ("effort", motor.max_torque, effort),
    )
    return ", ".join(f"{name} {value:.9g} {u}" for name, value, u in shown if math.isfinite(value)) or "none"
