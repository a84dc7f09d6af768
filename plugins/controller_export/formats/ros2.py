"""JointTrajectory messages of ROS 2 as YAML: trajectory_msgs/msg/JointTrajectory."""

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.host import Property, PropertyValues
from calmotion.support import write_text

from ..command_format import CommandFormat
from ..commands import CUBIC, LINEAR, QUINTIC, Commands, MotorCurves
from ..sampling import smooth_commands

_REST = 1e-6  # speed that counts as rest [rad/s or m/s]
_NANO = 1_000_000_000


class Ros2Trajectory(CommandFormat):
    """A ROS 2 JointTrajectory message as YAML, for `ros2 topic pub` and ros2_control's joint_trajectory_controller.

    The controller interpolates by quintics through positions, velocities and accelerations, by cubics without the
    accelerations, and by lines through positions alone.
    """

    idname = "export.ros2"
    label = "Write a ROS 2 trajectory"
    format = "ros2"
    suffix = ".yaml"
    players: ClassVar[dict[str, str]] = {"positions": LINEAR, "velocities": CUBIC, "accelerations": QUINTIC}
    properties: ClassVar[tuple[Property, ...]] = (
        Property(
            "fields",
            str,
            "accelerations",
            choices=tuple(players),
            description="What each point has: positions; velocities as well; accelerations as well",
        ),
    )

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Positions at the rate, with the derivatives of the same cubics."""
        return smooth_commands(curves, rate, self.players[properties.fields])

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write the message."""
        lines = [
            "header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}",
            f"joint_names: [{', '.join(_quoted(name) for name in curves.names)}]",
            "points:",
        ]
        given = zip(self.players, (commands.positions, commands.velocities, commands.accelerations), strict=True)
        columns = [(name, values) for name, values in given if values is not None]
        for n, time in enumerate(commands.times):
            lines += [f"{'  ' if k else '- '}{name}: {_row(values[n])}" for k, (name, values) in enumerate(columns)]
            sec, nanosec = divmod(round(float(time) * _NANO), _NANO)
            lines.append(f"  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}")
        write_text(file, "\n".join(lines) + "\n")
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the message, in the order of the names of its joints."""
        import yaml

        with open(files[0], encoding="utf-8") as stream:
            message: Any = yaml.load(stream, getattr(yaml, "CSafeLoader", yaml.SafeLoader))  # nosec B506  # a safe one
        try:
            order = [message["joint_names"].index(name) for name in curves.names]
            points = message["points"]
            stamps = [point["time_from_start"] for point in points]
            times = np.array([stamp["sec"] + stamp["nanosec"] / _NANO for stamp in stamps])
            found = {
                name: np.array([point[name] for point in points], np.float64)[:, order]
                for name in self.players
                if name in points[0]
            }
            player = [*self.players.values()][len(found) - 1]
            return Commands(player, times, found["positions"], found.get("velocities"), found.get("accelerations"))
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise ShotError("is no JointTrajectory with these joints", path=files[0], found=error) from error

    def notes(self, commands: Commands, curves: MotorCurves) -> tuple[str, ...]:
        """Motion at the last point, which the controller refuses by default."""
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
