"""Programs in URScript: a stream of servoj commands for a robot of Universal Robots."""

import re
from collections.abc import Sequence

import numpy as np
from calmotion.errors import ShotError
from calmotion.host import Property, PropertyValues
from calmotion.support import nearest, write_text

from ..command_format import CommandFormat
from ..commands import FOLLOW, Commands, Follower, MotorCurves
from ..sampling import followed_commands

JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
)  # fmt: skip
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LIST = rf"\[\s*({_NUMBER}(?:\s*,\s*{_NUMBER}){{5}})\s*\]"
_SERVOJ = re.compile(rf"^\s*servoj\({_LIST}\s*,\s*0\s*,\s*0\s*,\s*({_NUMBER})\s*,\s*({_NUMBER})\s*,\s*({_NUMBER})\)")
_MOVEJ = re.compile(rf"^\s*movej\({_LIST}")
_ATTRIBUTE = "export.ur.joints"
_REST = 1e-3  # speed that counts as rest [rad/s]


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
        Property("lookahead", float, 0.03, unit="s", minimum=0.03, maximum=0.2, description="Lookahead time of servoj"),
        Property(
            "cycle",
            float,
            0.002,
            unit="s",
            minimum=0.001,
            maximum=0.1,
            description="Cycle of the controller: 2 ms of the e-Series, 8 ms of the CB3",
        ),
        Property(
            "joints",
            str,
            "",
            description="Names of base, shoulder, elbow, wrist 1, 2 and 3, with commas; by default those of Universal "
            "Robots' description, else the order of the shot",
        ),
    )

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Commands ahead of the curves by the lag of the controller."""
        return followed_commands(curves, rate, properties.cycle, Follower(properties.gain, properties.lookahead))

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write the program."""
        order, follower = self._order(curves, properties), commands.follower
        assert follower is not None and commands.start is not None
        settings = f"{follower.lookahead:.6g}, {follower.gain:.6g}"
        periods = np.diff(commands.times)
        # the last command is held for as long as the one before
        periods = np.append(periods, periods[-1])
        lines = [
            "def calmotion():",
            f"  # {curves.shot}, {rate:.12g} commands a second; joints: {', '.join(curves.names[k] for k in order)}",
            f"  movej({_row(commands.start[order])}, a=0.5, v=0.3)",
        ]
        lines += [
            f"  servoj({_row(row[order])}, 0, 0, {period:.6g}, {settings})"
            for row, period in zip(commands.positions, periods, strict=True)
        ]
        write_text(file, "\n".join([*lines, "  stopj(2.0)", "end", ""]))
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the program."""
        with open(files[0], encoding="utf-8") as stream:
            lines = stream.read().splitlines()
        start = next((_MOVEJ.match(line) for line in lines if _MOVEJ.match(line)), None)
        found = [match for line in lines if (match := _SERVOJ.match(line))]
        if start is None or len(found) < 2:
            raise ShotError("this program has no movej and stream of servoj commands", path=files[0])
        back = np.argsort(self._order(curves, properties))
        positions = np.array([match[1].split(",") for match in found], np.float64)[:, back]
        periods, lookaheads, gains = np.array([match.groups()[1:] for match in found], np.float64).T
        times = np.concatenate([[0.0], np.cumsum(periods[:-1])])
        begin = np.array(start[1].split(","), np.float64)[back]
        follower = Follower(float(gains[0]), float(lookaheads[0]))
        return Commands(FOLLOW, times, positions, start=begin, follower=follower)

    def notes(self, commands: Commands, curves: MotorCurves) -> tuple[str, ...]:
        """What the player assumes of the controller, and whether the robot must start in motion."""
        law = (
            "Universal Robots does not publish the law of servoj; the loss holds for acceleration = gain x (command - "
            "position - lookahead x speed), whose lag the commands anticipate. Run the program slowly first"
        )
        if np.max(np.abs(curves.at(np.zeros(1), 1))) <= _REST:
            return (law,)
        return (
            law,
            "the shot begins in motion, but the robot at rest: it catches up, which is part of the loss. Begin at rest",
        )

    def _order(self, curves: MotorCurves, properties: PropertyValues) -> list[int]:
        return order_of([name.strip() for name in properties.joints.split(",") if name.strip()], curves)


def order_of(names: Sequence[str], curves: MotorCurves) -> list[int]:
    """Which motor is base, shoulder, elbow, wrist 1, 2 and 3.

    Args:
        names: Their names or prim paths in this order; empty: those of Universal Robots' description where the robot
            has them, else the order of the shot.
        curves: Of the motors.

    Raises:
        ShotError: The robot has not six hinges with these names.
    """
    if len(curves.motors) != 6 or any(motor.linear for motor in curves.motors):
        raise ShotError(
            "a controller of Universal Robots drives six hinges",
            attribute="--to",
            found=f"{len(curves.motors)} motors: {', '.join(curves.names)}",
            remedy="Use ros2 or csv for this robot",
        )
    if not names:
        return [curves.names.index(name) for name in JOINTS] if set(JOINTS) == set(curves.names) else list(range(6))
    paths = [motor.path for motor in curves.motors]
    order = []
    for name in names:
        if name not in curves.names and name not in paths:
            raise ShotError(
                "no motor has this name",
                attribute=_ATTRIBUTE,
                found=name,
                remedy=f"{nearest(name, curves.names)}Use the names {', '.join(curves.names)}",
            )
        order.append(curves.names.index(name) if name in curves.names else paths.index(name))
    if sorted(order) != list(range(6)):
        raise ShotError(
            "each of the six joints must be named once",
            attribute=_ATTRIBUTE,
            found=", ".join(names),
            remedy="Name base, shoulder, elbow, wrist 1, 2 and 3 in this order",
        )
    return order


def _row(values: np.ndarray) -> str:
    return f"[{', '.join(f'{value:.6f}' for value in values)}]"
