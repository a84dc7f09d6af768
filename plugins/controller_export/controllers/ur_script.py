"""Programs in URScript: a stream of servoj commands for a robot of Universal Robots."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from calmotion.errors import ShotError
from calmotion.support import nearest, write_text

from ..commands import FOLLOW, Commands, Follower, MotorCurves

JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
)  # fmt: skip
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LIST = rf"\[\s*({_NUMBER}(?:\s*,\s*{_NUMBER}){{5}})\s*\]"
_SERVOJ = re.compile(rf"^\s*servoj\({_LIST}\s*,\s*0\s*,\s*0\s*,\s*({_NUMBER})\s*,\s*({_NUMBER})\s*,\s*({_NUMBER})\)")
_MOVEJ = re.compile(rf"^\s*movej\({_LIST}")
_ATTRIBUTE = "export.ur.joints"
_REST = 1e-3  # speed that counts as rest [rad/s]


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
            "a controller of Universal Robots drives six hinges", attribute="--to",
            found=f"{len(curves.motors)} motors: {', '.join(curves.names)}",
            remedy="Use ros2 or csv for this robot",
        )  # fmt: skip
    if not names:
        return [curves.names.index(name) for name in JOINTS] if set(JOINTS) == set(curves.names) else list(range(6))
    paths = [motor.path for motor in curves.motors]
    order = []
    for name in names:
        if name not in curves.names and name not in paths:
            raise ShotError(
                "no motor has this name", attribute=_ATTRIBUTE, found=name,
                remedy=f"{nearest(name, curves.names)}Use the names {', '.join(curves.names)}",
            )  # fmt: skip
        order.append(curves.names.index(name) if name in curves.names else paths.index(name))
    if sorted(order) != list(range(6)):
        raise ShotError(
            "each of the six joints must be named once", attribute=_ATTRIBUTE, found=", ".join(names),
            remedy="Name base, shoulder, elbow, wrist 1, 2 and 3 in this order",
        )  # fmt: skip
    return order


def write_program(file: str, commands: Commands, curves: MotorCurves, rate: float, order: Sequence[int]) -> None:
    """Write the program, atomically.

    Raises:
        OSError: It cannot be written.
    """
    follower = commands.follower
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


def read_program(file: str, order: Sequence[int]) -> Commands:
    """Read the commands of a program, in the order of the motors.

    Raises:
        ShotError: It has no stream of servoj commands after a movej.
    """
    with open(file, encoding="utf-8") as stream:
        lines = stream.read().splitlines()
    start = next((_MOVEJ.match(line) for line in lines if _MOVEJ.match(line)), None)
    found = [match for line in lines if (match := _SERVOJ.match(line))]
    if start is None or len(found) < 2:
        raise ShotError("this program has no movej and stream of servoj commands", path=file)
    back = np.argsort(order)
    positions = np.array([match[1].split(",") for match in found], np.float64)[:, back]
    periods, lookaheads, gains = np.array([match.groups()[1:] for match in found], np.float64).T
    times = np.concatenate([[0.0], np.cumsum(periods[:-1])])
    begin = np.array(start[1].split(","), np.float64)[back]
    return Commands(FOLLOW, times, positions, start=begin, follower=Follower(float(gains[0]), float(lookaheads[0])))


def notes_on(curves: MotorCurves) -> tuple[str, ...]:
    """What the player assumes of the controller, and whether the robot must start in motion."""
    law = (
        "Universal Robots does not publish the law of servoj; the loss holds for acceleration = gain x (command - "
        "position - lookahead x speed), whose lag the commands anticipate. Run the program slowly first"
    )
    if np.max(np.abs(curves.at(np.zeros(1), 1))) <= _REST:
        return (law,)
    moving = "the shot begins in motion, but the robot at rest: it catches up, which is part of the loss. Begin at rest"
    return law, moving


def _row(values: np.ndarray) -> str:
    return f"[{', '.join(f'{value:.6f}' for value in values)}]"
