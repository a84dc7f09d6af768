"""Formats of `calmotion export`: ROS 2 JointTrajectory, CSV with units, servo ticks as JSON and C header."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from calmotion.control.commands import CUBIC, HOLD, LINEAR, QUINTIC, Commands, MotorCurves
from calmotion.host import Property, PropertyValues, registration
from calmotion.workflow.exporting.command_format import CommandFormat


class Ros2Trajectory(CommandFormat):
    """A ROS 2 JointTrajectory message as YAML, for `ros2 topic pub` and ros2_control's joint_trajectory_controller.

    The controller interpolates by quintics through positions, velocities and accelerations, by cubics without the
    accelerations, and by lines through positions alone.
    """

    idname = "export.ros2"
    label = "Write a ROS 2 trajectory"
    format = "ros2"
    suffix = ".yaml"
    properties: ClassVar[tuple[Property, ...]] = (
        Property(
            "fields", str, "accelerations", choices=("positions", "velocities", "accelerations"),
            description="What each point has: positions; velocities as well; accelerations as well",
        ),
    )  # fmt: skip

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Positions at the rate, with the derivatives of the same cubics."""
        from .sampling import smooth_commands

        kinds = {"positions": LINEAR, "velocities": CUBIC, "accelerations": QUINTIC}
        return smooth_commands(curves, rate, kinds[properties.fields])

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write the message."""
        from .ros2 import write_trajectory

        write_trajectory(file, commands, curves.names)
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the message."""
        from .ros2 import read_trajectory

        return read_trajectory(files[0], curves.names)

    def notes(self, commands: Commands, curves: MotorCurves) -> tuple[str, ...]:
        """Motion at the last point, which the controller refuses by default."""
        from .ros2 import notes_on

        return notes_on(commands)


class Ros2Bag(Ros2Trajectory):
    """The same message in an MCAP file, which rosbag2 plays."""

    idname = "export.mcap"
    label = "Write a ROS 2 trajectory as MCAP"
    format = "mcap"
    suffix = ".mcap"
    properties = (
        *Ros2Trajectory.properties,
        Property("topic", str, "/joint_trajectory_controller/joint_trajectory", description="Topic of the message"),
    )

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write the message."""
        from .mcap_bag import write_bag

        write_bag(file, commands, curves.names, properties.topic)
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the message."""
        from .mcap_bag import read_bag

        return read_bag(files[0], curves.names, properties.topic)


class CsvTable(CommandFormat):
    """A table with a header that has rate, units and limits; one row for each command."""

    idname = "export.csv"
    label = "Write a table of commands"
    format = "csv"
    suffix = ".csv"
    properties = (
        Property("angles", str, "rad", choices=("rad", "deg"), description="Unit of angles; lengths are in m"),
        Property(
            "player", str, LINEAR, choices=(HOLD, LINEAR, CUBIC, QUINTIC),
            description="How the player of the table interpolates; for cubic and quintic the table has velocities, for "
            "quintic accelerations as well",
        ),
        Property("digits", int, 12, minimum=1, maximum=17, description="Significant digits of the values"),
    )  # fmt: skip

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Positions at the rate, with the derivatives that the player needs."""
        from .sampling import held_commands, smooth_commands

        if properties.player == HOLD:
            return held_commands(curves, rate)
        return smooth_commands(curves, rate, properties.player)

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write the table."""
        from .csv_table import write_table

        write_table(file, commands, curves, rate, degrees=properties.angles == "deg", digits=properties.digits)
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the table."""
        from .csv_table import read_table

        return read_table(files[0], curves)


class ServoTicks(CommandFormat):
    """Positions of servos in their own ticks, at a fixed period, as JSON and as a header for C.

    A servo holds each command until the next one. Resolution, range, direction and centre of each servo come from a
    TOML file.
    """

    idname = "export.ticks"
    label = "Write servo ticks"
    format = "ticks"
    suffix = ".json"
    properties = (
        Property("motors", str, "", description="TOML file with a table for each motor; see docs/exporting.md"),
    )

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Positions at the rate."""
        from .sampling import held_commands

        return held_commands(curves, rate)

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write both files."""
        from .servos import read_servos
        from .ticks import write_ticks

        return write_ticks(file, commands, curves, rate, read_servos(properties.motors, curves))

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the ticks of the JSON file as angles."""
        from .ticks import read_ticks

        return read_ticks(files[0], curves)


register, unregister = registration(Ros2Trajectory, Ros2Bag, CsvTable, ServoTicks)
