"""The table: comment lines that a person and a program read, then the columns."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from calmotion.errors import ShotError
from calmotion.shot import Animation, Character, Motor, Provenance, Result
from calmotion.shot.curves import commanded_values
from calmotion.support.files import try_writing, write_text


def write_curves(
    file: str, character: Character, animation: Animation, provenance: Provenance, result: Result, *, rate: float,
    degrees: bool,
) -> int:  # fmt: skip
    """Write the motor curves atomically; returns the number of rows.

    Raises:
        ShotError: As `refuse_unwritable`.
    """
    refuse_unwritable(file, character)
    end = float(animation.frame_times[-1])
    times = np.arange(math.floor(end * rate + 1e-6) + 1) / rate
    values = commanded_values(character, animation, result, times)
    units = [1.0 if motor.linear or not degrees else math.degrees(1.0) for motor in character.motors]
    lines = [*_header(character, provenance, rate, degrees), ",".join(["time_s", *(m.path for m in character.motors)])]
    lines += [
        ",".join([f"{time:.9g}", *(f"{value:.12g}" for value in row)])
        for time, row in zip(times, values * units, strict=True)
    ]
    with _refused(file):
        write_text(file, "\n".join(lines) + "\n")
    return len(times)


def refuse_unwritable(file: str, character: Character) -> None:
    """Refuse curves that cannot be written.

    Raises:
        ShotError: No file is named, it cannot be written, or there are no motors.
    """
    if not file:
        raise ShotError(
            "no file is named for the curves",
            attribute="curves.export.file",
            remedy="Name one: --set curves.export.file=curves.csv",
        )
    if not character.motors:
        raise ShotError("the shot has no motors to export", path=character.path, remedy="Leave out --run curves.export")
    with _refused(file):
        try_writing(file)


def _header(character: Character, provenance: Provenance, rate: float, degrees: bool) -> Iterator[str]:
    angle = "deg" if degrees else "rad"
    yield f"# shot: {Path(provenance.shot).name}"
    yield f"# rate_hz: {rate:.12g}"
    yield f"# units: time s, angle {angle}, length m, torque N m, force N"
    for motor in character.motors:
        yield f"# limits of {motor.path}: {_limits(motor, character, angle)}"


def _limits(motor: Motor, character: Character, angle: str) -> str:
    joint = character.joints[motor.joint]
    unit, effort = ("m", "N") if motor.linear else (angle, "N m")
    factor = math.degrees(1.0) if unit == "deg" else 1.0
    shown = (
        ("lower", joint.lower * factor, unit),
        ("upper", joint.upper * factor, unit),
        ("velocity", motor.max_velocity * factor, f"{unit}/s"),
        ("acceleration", motor.max_acceleration * factor, f"{unit}/s^2"),
        ("effort", motor.max_torque, effort),
    )
    return ", ".join(f"{name} {value:.9g} {u}" for name, value, u in shown if math.isfinite(value)) or "none"


@contextmanager
def _refused(target: str) -> Iterator[None]:
    """Errors of the file system as those of the shot."""
    try:
        yield
    except OSError as error:
        raise ShotError(
            "the curves cannot be written",
            path=target,
            attribute="curves.export.file",
            found=error.strerror,
            remedy="Choose another file",
        ) from error
