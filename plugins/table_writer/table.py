"""The columns of the table, as the USD contract names them, and writing them."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping

import numpy as np
from calmotion.errors import ShotError
from calmotion.shot import Character, Result
from calmotion.shot.character import Array
from calmotion.support.files import write_whole


def columns(character: Character, result: Result) -> dict[str, Array]:
    """Name to values, all of the same length.

    The motion is the optimised one where there is one, else the simulated one. A motor's input is the
    animator's curve, its output the curve that was simulated.

    Reactions are what each joint does to its body1, world axes, see `calmotion.shot.Motion`.

    Returns:
        `time_s` [s]; positions and errors of targets [m], rotation errors [rad]; motor angles [rad] or lengths [m],
        efforts [N m] or [N]; `<joint path>.force.x` and so on [N], `<joint path>.moment.x` and so on [N m].
    """
    simulation = result.after or result.before
    motion = simulation.motion
    # The pre-roll is not part of the shot; times are sums of steps, so frame 0 may be a rounding before 0.
    rows = motion.times >= -1e-9
    table = {"time_s": motion.times[rows]}
    for k, target in enumerate(character.targets):
        for axis, name in enumerate("xyz"):
            table[f"{target.path}.{name}"] = motion.target_positions[rows, k, axis]
        table[f"{target.path}.error"] = simulation.position_errors[rows, k]
        table[f"{target.path}.rotation_error"] = simulation.rotation_errors[rows, k]
    for m, motor in enumerate(character.motors):
        table[f"{motor.path}.input"] = result.reference.motor_values[rows, m]
        table[f"{motor.path}.output"] = motion.motor_values[rows, m]
        table[f"{motor.path}.effort"] = motion.motor_efforts[rows, m]
    for name, values in (("force", motion.joint_forces), ("moment", motion.joint_moments)):
        if values is None:
            continue
        for j, joint in enumerate(character.joints):
            for axis, letter in enumerate("xyz"):
                table[f"{joint.path}.{name}.{letter}"] = values[rows, j, axis]
    return table


def write_table(path: str, table: Mapping[str, Array]) -> None:
    """Write columns as CSV, atomically: `path` holds the old table or the whole new one.

    Raises:
        ShotError: When the file cannot be written.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(table)
    writer.writerows([f"{value:.12g}" for value in row] for row in np.column_stack(list(table.values())))
    try:
        write_whole(path, text.getvalue())
    except OSError as error:
        raise ShotError(
            "the table cannot be written", path=path, found=error.strerror, remedy="Choose another file for --csv."
        ) from error
