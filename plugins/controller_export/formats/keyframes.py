"""Cubic Bezier keyframes as plain JSON; docs/reference/controller_formats.md describes the format."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from calmotion.errors import ShotError
from calmotion.host import Property, PropertyValues
from calmotion.support import write_text

from ..command_format import CommandFormat
from ..commands import BEZIER, Commands, MotorCurves
from ..sampling import bezier_commands

FORMAT = "calmotion keyframes 1"


class Keyframes(CommandFormat):
    """Cubic Bezier keyframes of the motors as plain JSON; the rate is that of the keyframes."""

    idname = "export.keyframes"
    label = "Write keyframes"
    format = "keyframes"
    suffix = ".json"
    properties: ClassVar[tuple[Property, ...]] = (
        Property("digits", int, 9, minimum=1, maximum=17, description="Significant digits of the values"),
    )

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Keyframes with the slopes of the curves."""
        return bezier_commands(curves, rate)

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write the keyframes."""

        def rounded(*values: float) -> list[float]:
            return [float(f"{value:.{properties.digits}g}") for value in values]

        assert commands.handles is not None
        motors = []
        for k, (motor, name) in enumerate(zip(curves.motors, curves.names, strict=True)):
            frames: list[dict[str, Any]] = [
                {"time": float(f"{time:.12g}"), "value": rounded(value)[0]}
                for time, value in zip(commands.times, commands.positions[:, k], strict=True)
            ]
            for before, after, handle in zip(frames, frames[1:], commands.handles[:, k], strict=False):
                before["out"], after["in"] = rounded(*handle[:2]), rounded(*handle[2:])
            kind = "length" if motor.linear else "angle"
            motors.append({"name": name, "path": motor.path, "kind": kind, "keyframes": frames})
        units = {"time": "s", "angle": "rad", "length": "m"}
        content = {"format": FORMAT, "shot": curves.shot, "units": units, "motors": motors}
        write_text(file, json.dumps(content).replace('{"time"', '\n{"time"') + "\n")  # a line for each keyframe
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the keyframes."""
        with open(files[0], encoding="utf-8") as stream:
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
            raise ShotError("this file does not hold these keyframes", path=files[0], found=error) from error
        handles = np.moveaxis(np.concatenate([after, before], axis=2), 0, 1)
        return Commands(BEZIER, times[0], positions, handles=handles)
