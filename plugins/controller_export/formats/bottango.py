"""Curves for Bottango's open-source drivers: a text of `sC` commands, and a JSON with the ranges of the motors.

`sC,identifier,start,duration,start y,control x,control y,end y,control x,control y`: times in ms, values in 8192ths
of the motor's range, control points relative to their ends (Bottango's protocol, its commands "Set Curve").
"""

import json
import math
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from calmotion.errors import ShotError, raise_all
from calmotion.host import Property, PropertyValues
from calmotion.support import write_text

from ..command_format import CommandFormat
from ..commands import BEZIER, Commands, MotorCurves
from ..sampling import bezier_commands
from .servos import motor_tables, number_of

FULL = 8192  # of a motor's range
_KNOWN = ("id", "minimum", "maximum")
_ATTRIBUTE = "export.bottango.motors"
_REMEDY = 'Write a table for each motor, such as [shoulder] with id = "3", minimum = -90 and maximum = 90 (degrees)'
_STEP = math.radians(10.0)  # ranges that nobody gives are whole multiples of it [rad], or of 1 cm


@dataclass(frozen=True)
class Effector:
    """A motor as Bottango knows it.

    Attributes:
        name: Of the motor's joint.
        id: Its identifier in Bottango.
        minimum, maximum: Values of the joint at 0 and at `FULL` [rad or m].
    """

    name: str
    id: str
    minimum: float
    maximum: float


class BottangoCurves(CommandFormat):
    """Curves for Bottango's open-source drivers, and a JSON with the ranges of the motors."""

    idname = "export.bottango"
    label = "Write curves for Bottango"
    format = "bottango"
    suffix = ".txt"
    highest_rate = 500.0
    properties = (
        Property(
            "motors",
            str,
            "",
            description="TOML file with a table for each motor: id, range (docs/reference/controller_formats.md)",
        ),
    )

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Keyframes at the rate."""
        return bezier_commands(curves, rate)

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write both files."""
        effectors = effectors_of(properties.motors, commands, curves)
        assert commands.handles is not None
        starts = np.rint(1e3 * commands.times).astype(np.int64)
        durations = np.diff(starts)
        if np.any(durations < 1):
            raise ShotError(
                "keyframes of Bottango are at least 1 ms apart",
                path=curves.shot,
                attribute="--rate",
                remedy="Use 500 or less",
            )
        scale = np.array([FULL / (one.maximum - one.minimum) for one in effectors])
        low = np.array([one.minimum for one in effectors])
        values = np.rint((commands.positions - low) * scale).astype(np.int64)
        x = np.rint(1e3 * commands.handles[..., [0, 2]]).astype(np.int64)
        y = np.rint(commands.handles[..., [1, 3]] * scale[:, None]).astype(np.int64)
        lines = []
        for n, duration in enumerate(durations):
            for k, one in enumerate(effectors):
                ends = (values[n, k], x[n, k, 0], y[n, k, 0], values[n + 1, k], x[n, k, 1], y[n, k, 1])
                lines.append(",".join(map(str, ("sC", one.id, starts[n], duration, *ends))))
        write_text(file, "\n".join(lines) + "\n")
        ranges = f"{os.path.splitext(file)[0]}_motors.json"
        content = {
            "shot": curves.shot,
            "units": {"angle": "rad", "length": "m"},
            "full": FULL,
            "motors": [asdict(one) for one in effectors],
        }
        write_text(ranges, json.dumps(content, indent=1) + "\n")
        return file, ranges

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read both files."""
        with open(files[1], encoding="utf-8") as stream:
            content = json.load(stream)
        with open(files[0], encoding="utf-8") as stream:
            rows = [line.split(",") for line in stream.read().splitlines() if line.startswith("sC,")]
        try:
            motors = {entry["name"]: Effector(**entry) for entry in content["motors"]}
            full = float(content["full"])
            pieces = [
                np.array([row[2:] for row in rows if row[1] == motors[name].id], np.float64).reshape(-1, 8)
                for name in curves.names
            ]
            table = np.stack(pieces, axis=1)  # curves, motors, columns
        except (KeyError, TypeError, ValueError) as error:
            raise ShotError("these files do not hold these curves", path=files[0], found=error) from error
        starts, ends = table[:, 0, 0], table[:, 0, 0] + table[:, 0, 1]
        joined = np.all(table[:, :, :2] == table[:, :1, :2]) and np.all(starts[1:] == ends[:-1])
        if not joined or np.any(table[1:, :, 2] != table[:-1, :, 5]):
            raise ShotError("the curves of these motors do not join", path=files[0])
        low = np.array([motors[name].minimum for name in curves.names])
        scale = (np.array([motors[name].maximum for name in curves.names]) - low) / full
        positions = low + scale * np.concatenate([table[:, :, 2], table[-1:, :, 5]])
        x, y = 1e-3 * table[:, :, [3, 6]], scale[:, None] * table[:, :, [4, 7]]
        handles = np.stack([x[..., 0], y[..., 0], x[..., 1], y[..., 1]], axis=2)
        return Commands(BEZIER, 1e-3 * np.append(starts, ends[-1]), positions, handles=handles)


def effectors_of(file: str, commands: Commands, curves: MotorCurves) -> tuple[Effector, ...]:
    """The motors, in their order, with what a TOML file has of them.

    Without a range of its own, a motor has that of its joint's limits, or what its motion needs.

    Raises:
        ShotError: The file does not fit.
    """
    tables = motor_tables(file, curves, _KNOWN, _REMEDY) if file else {}
    result, problems = [], []
    for k, (motor, name) in enumerate(zip(curves.motors, curves.names, strict=True)):
        table = tables.get(motor.path, tables.get(name, {}))
        unit = 1.0 if motor.linear else math.radians(1.0)
        low, high = _range(k, commands, curves)
        low = unit * number_of(file, name, table, "minimum", low / unit, _REMEDY)
        high = unit * number_of(file, name, table, "maximum", high / unit, _REMEDY)
        least, most = float(commands.positions[:, k].min()), float(commands.positions[:, k].max())
        if high <= low or least < low - 1e-9 or most > high + 1e-9:
            problems.append(
                ShotError(
                    "the motion leaves the range of this motor",
                    path=motor.path,
                    attribute=_ATTRIBUTE,
                    found=f"{least / unit:.4g} to {most / unit:.4g}, range {low / unit:.4g} to {high / unit:.4g}",
                    remedy="Correct minimum and maximum, or limit the joint",
                )
            )
        result.append(Effector(name, str(table.get("id", k + 1)), low, high))
    twice = [one.id for k, one in enumerate(result) if one.id in [other.id for other in result[:k]]]
    if twice:
        problems.append(ShotError("two motors have the same id", path=file, attribute="id", found=twice[0]))
    raise_all(problems)
    return tuple(result)


def _range(k: int, commands: Commands, curves: MotorCurves) -> tuple[float, float]:
    """The limits of a joint, or round values beyond its motion [rad or m]."""
    lower, upper = (float(limit) for limit in curves.limits[k])
    step = 0.01 if curves.motors[k].linear else _STEP
    if not math.isfinite(lower):
        lower = step * math.floor(float(commands.positions[:, k].min()) / step - 1.0)
    if not math.isfinite(upper):
        upper = step * math.ceil(float(commands.positions[:, k].max()) / step + 1.0)
    return lower, upper
