"""Cubic Bezier keyframes as plain JSON; docs/reference/controller_formats.md describes the format."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from calmotion.errors import ShotError
from calmotion.support import write_text

from ..commands import BEZIER, Commands, MotorCurves

FORMAT = "calmotion keyframes 1"


def write_keyframes(file: str, commands: Commands, curves: MotorCurves, digits: int) -> None:
    """Write keyframes, atomically.

    Raises:
        OSError: They cannot be written.
    """
    assert commands.handles is not None
    lines = [
        "{",
        f' "format": {json.dumps(FORMAT)},',
        f' "shot": {json.dumps(curves.shot)},',
        ' "units": {"time": "s", "angle": "rad", "length": "m"},',
        ' "motors": [',
    ]
    last = len(curves.motors) - 1
    for k, (motor, name) in enumerate(zip(curves.motors, curves.names, strict=True)):
        kind = "length" if motor.linear else "angle"
        head = f'"name": {json.dumps(name)}, "path": {json.dumps(motor.path)}, "kind": "{kind}"'
        lines.append(f'  {{{head}, "keyframes": [')
        rows = [_keyframe(commands, n, k, digits) for n in range(len(commands.times))]
        lines += [f"   {row}{',' if n < len(rows) - 1 else ''}" for n, row in enumerate(rows)]
        lines.append(f"  ]}}{',' if k < last else ''}")
    write_text(file, "\n".join([*lines, " ]", "}", ""]))


def read_keyframes(file: str, curves: MotorCurves) -> Commands:
    """Read keyframes, in the order of the motors.

    Raises:
        ShotError: The file does not hold them.
    """
    with open(file, encoding="utf-8") as stream:
        content: Any = json.load(stream)
    try:
        if content["format"] != FORMAT:
            raise ValueError(content["format"])
        by_path = {entry["path"]: entry["keyframes"] for entry in content["motors"]}
        frames = [by_path[motor.path] for motor in curves.motors]
        times = np.array([[frame["time"] for frame in own] for own in frames], np.float64)
        if np.any(times != times[0]):
            raise ValueError("the motors have keyframes at different times")
        positions = np.array([[frame["value"] for frame in own] for own in frames], np.float64).T
        after = np.array([[frame["out"] for frame in own[:-1]] for own in frames], np.float64)
        before = np.array([[frame["in"] for frame in own[1:]] for own in frames], np.float64)
    except (KeyError, TypeError, ValueError) as error:
        raise ShotError("this file does not hold these keyframes", path=file, found=error) from error
    handles = np.moveaxis(np.concatenate([after, before], axis=2), 0, 1)
    return Commands(BEZIER, times[0], positions, handles=handles)


def _keyframe(commands: Commands, n: int, k: int, digits: int) -> str:
    assert commands.handles is not None
    parts = [f'"time": {commands.times[n]:.12g}', f'"value": {commands.positions[n, k]:.{digits}g}']
    if n > 0:
        parts.append(f'"in": [{_pair(commands.handles[n - 1, k, 2:], digits)}]')
    if n < len(commands.times) - 1:
        parts.append(f'"out": [{_pair(commands.handles[n, k, :2], digits)}]')
    return f"{{{', '.join(parts)}}}"


def _pair(values: np.ndarray, digits: int) -> str:
    return f"{values[0]:.12g}, {values[1]:.{digits}g}"
