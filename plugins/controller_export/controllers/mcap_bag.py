"""JointTrajectory messages of ROS 2 in MCAP files, which rosbag2 and Foxglove open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.support import replaced

from ..commands import Commands
from .ros2 import commands_of, stamp

TYPE = "trajectory_msgs/msg/JointTrajectory"
_LINE = "=" * 80
# Definitions of the messages, as rosbag2 stores them.
_DEFINITION = f"""std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint[] points
{_LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_LINE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
{_LINE}
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
{_LINE}
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
"""


def write_bag(file: str, commands: Commands, names: Sequence[str], topic: str) -> None:
    """Write one message, atomically.

    Raises:
        OSError: It cannot be written.
        ShotError: The package for MCAP is missing.
    """
    writer_class, _ = _package()
    with replaced(file) as temporary, open(temporary, "wb") as stream:
        writer = writer_class(stream)
        schema = writer.register_msgdef(TYPE, _DEFINITION)
        writer.write_message(topic, schema, _message(commands, names), log_time=0, publish_time=0)
        writer.finish()


def read_bag(file: str, names: Sequence[str], topic: str) -> Commands:
    """Read the message, in the order of the names of its joints.

    Raises:
        ShotError: The file holds no such message.
    """
    _, read_messages = _package()
    with open(file, "rb") as stream:
        for found in read_messages(stream, topics=[topic]):
            return commands_of(_plain(found.ros_msg), names, file)
    raise ShotError("this file has no message on the topic", path=file, found=topic)


def _package() -> tuple[Any, Any]:
    try:
        from mcap_ros2.reader import read_ros2_messages
        from mcap_ros2.writer import Writer
    except ImportError as error:
        raise ShotError(
            "the package that writes MCAP is not installed", attribute="--to", found=error.name,
            remedy="Install it: pip install mcap-ros2-support",
        ) from error  # fmt: skip
    return Writer, read_ros2_messages


def _message(commands: Commands, names: Sequence[str]) -> dict[str, Any]:
    def values(of: Array | None, n: int) -> list[float]:
        return [] if of is None else of[n].tolist()

    points = [
        {
            "positions": values(commands.positions, n),
            "velocities": values(commands.velocities, n),
            "accelerations": values(commands.accelerations, n),
            "effort": [],
            "time_from_start": stamp(time),
        }
        for n, time in enumerate(commands.times)
    ]
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    return {"header": header, "joint_names": list(names), "points": points}


def _plain(message: Any) -> dict[str, Any]:
    """The message in the form in which YAML has it, without fields that are empty."""
    points = []
    for point in message.points:
        fields = {name: list(getattr(point, name)) for name in ("positions", "velocities", "accelerations")}
        duration = {"sec": point.time_from_start.sec, "nanosec": point.time_from_start.nanosec}
        points.append({name: value for name, value in fields.items() if np.size(value)} | {"time_from_start": duration})
    return {"joint_names": list(message.joint_names), "points": points}
