"""Formats of `calmotion export`: ROS 2, CSV with units, servo ticks, URScript, curves of Bottango."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from calmotion.host import Property, PropertyValues

from ..command_format import CommandFormat
from ..commands import CUBIC, HOLD, LINEAR, QUINTIC, Commands, Follower, MotorCurves


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
        from ..sampling import smooth_commands

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
        from ..sampling import held_commands, smooth_commands

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
        Property(
            "motors",
            str,
            "",
            description="TOML file with a table for each motor; see docs/reference/controller_formats.md",
        ),
    )

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Positions at the rate."""
        from ..sampling import held_commands

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


class UrScript(CommandFormat):
    """A program of servoj commands for a robot of Universal Robots.

    Universal Robots documents what gain and lookahead time of servoj mean, not its law. The player takes them at their
    word: the acceleration is gain times the distance to the command of the position projected forward by the lookahead
    time.
    """

    idname = "export.ur"
    label = "Write a program in URScript"
    format = "ur"
    suffix = ".script"
    highest_rate = 500.0
    properties = (
        Property("gain", float, 2000.0, minimum=100.0, maximum=2000.0, description="Gain of servoj, 1/s^2"),
        Property(
            "lookahead", float, 0.03, unit="s", minimum=0.03, maximum=0.2, description="Lookahead time of servoj"
        ),
        Property(
            "cycle", float, 0.002, unit="s", minimum=0.001, maximum=0.1,
            description="Cycle of the controller: 2 ms of the e-Series, 8 ms of the CB3",
        ),
        Property(
            "joints", str, "",
            description="Names of base, shoulder, elbow, wrist 1, 2 and 3, with commas; by default those of Universal "
            "Robots' description, else the order of the shot",
        ),
    )  # fmt: skip

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Commands ahead of the curves by the lag of the controller."""
        from ..sampling import followed_commands

        return followed_commands(curves, rate, properties.cycle, Follower(properties.gain, properties.lookahead))

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write the program."""
        from .ur_script import write_program

        write_program(file, commands, curves, rate, self._order(curves, properties))
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the program."""
        from .ur_script import read_program

        return read_program(files[0], self._order(curves, properties))

    def notes(self, commands: Commands, curves: MotorCurves) -> tuple[str, ...]:
        """What the player assumes of the controller."""
        from .ur_script import notes_on

        return notes_on(curves)

    def _order(self, curves: MotorCurves, properties: PropertyValues) -> list[int]:
        from .ur_script import order_of

        return order_of([name.strip() for name in properties.joints.split(",") if name.strip()], curves)


class BottangoCurves(CommandFormat):
    """Curves for Bottango's open-source drivers, and a JSON with the ranges of the motors."""

    idname = "export.bottango"
    label = "Write curves for Bottango"
    format = "bottango"
    suffix = ".txt"
    highest_rate = 500.0
    properties = (
        Property(
            "motors", str, "",
            description="TOML file with a table for each motor: id, range (docs/reference/controller_formats.md)",
        ),
    )  # fmt: skip

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Keyframes at the rate."""
        from ..sampling import bezier_commands

        return bezier_commands(curves, rate)

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write both files."""
        from .bottango import effectors_of, write_curves

        return write_curves(file, commands, curves, effectors_of(properties.motors, commands, curves))

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read both files."""
        from .bottango import read_curves

        return read_curves(files, curves)
