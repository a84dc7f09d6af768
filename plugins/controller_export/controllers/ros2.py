"""JointTrajectory messages of ROS 2 as YAML: trajectory_msgs/msg/JointTrajectory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.support import write_text

from ..commands import CUBIC, LINEAR, QUINTIC, Commands

_REST = 1e-6  # speed that counts as rest [rad/s or m/s]
_NANO = 1_000_000_000


def write_trajectory(file: str, commands: Commands, names: Sequence[str]) -> None:
    """Write the message, atomically.

    Raises:
        OSError: It cannot be written.
    """
    lines = [
        "header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}",
        f"joint_names: [{', '.join(_quoted(name) for name in names)}]",
        "points:",
    ]
    columns = [("positions", commands.positions), ("velocities", commands.velocities)]
    columns.append(("accelerations", commands.accelerations))
    present = [(name, values) for name, values in columns if values is not None]
    for n, time in enumerate(commands.times):
        lines += [f"{'- ' if k == 0 else '  '}{name}: {_row(values[n])}" for k, (name, values) in enumerate(present)]
        after = stamp(time)
        lines.append(f"  time_from_start: {{sec: {after['sec']}, nanosec: {after['nanosec']}}}")
    write_text(file, "\n".join(lines) + "\n")


def read_trajectory(file: str, names: Sequence[str]) -> Commands:
    """Read a message, in the order of the names of its joints.

    Raises:
        ShotError: It is no such message.
    """
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    with open(file, encoding="utf-8") as stream:
        message: Any = yaml.load(stream, loader)  # nosec B506  # a safe one
    return commands_of(message, names, file)


def stamp(time: float) -> dict[str, int]:
    """A time [s] as a duration of ROS 2."""
    sec, nanosec = divmod(round(float(time) * _NANO), _NANO)
    return {"sec": sec, "nanosec": nanosec}


def commands_of(message: Any, names: Sequence[str], file: str) -> Commands:
    """The commands of a message.

    Args:
        message: As dictionaries and lists.
        names: Of the joints, in the order of the motors.
        file: Where it was read, for errors.

    Raises:
        ShotError: It is no JointTrajectory with these joints.
    """
    try:
        order = [message["joint_names"].index(name) for name in names]
        points = message["points"]
        stamps = [point["time_from_start"] for point in points]
        times = np.array([stamp["sec"] + stamp["nanosec"] / _NANO for stamp in stamps])
        positions, velocities, accelerations = (
            np.array([point[name] for point in points], np.float64)[:, order] if name in points[0] else None
            for name in ("positions", "velocities", "accelerations")
        )
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise ShotError("this is not a JointTrajectory with these joints", path=file, found=error) from error
    if positions is None:
        raise ShotError("a JointTrajectory without positions", path=file, attribute="points")
    kind = LINEAR if velocities is None else CUBIC if accelerations is None else QUINTIC
    return Commands(kind, times, positions, velocities, accelerations)


def notes_on(commands: Commands) -> tuple[str, ...]:
    """What to set up in the controller for these commands."""
    if commands.velocities is None or np.max(np.abs(commands.velocities[-1]), initial=0.0) <= _REST:
        return ()
    return (
        "the motors still move at the last frame, which joint_trajectory_controller refuses: set its parameter "
        "allow_nonzero_velocity_at_trajectory_end to true",
    )


def _row(values: Array) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _number(value: float) -> str:
    """A number that YAML 1.1 reads as a float: with a point, also before an exponent."""
    text = f"{value:.12g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa if '.' in mantissa else mantissa + '.0'}e{exponent}"
    return text if "." in text else f"{text}.0"


def _quoted(name: str) -> str:
    return "'" + name.replace("'", "''") + "'"
