"""Commands in the ticks of servos, as JSON and as a header for C."""

import json
import os
import re
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError, raise_all
from calmotion.host import Property, PropertyValues
from calmotion.support import write_text
from numpy.typing import NDArray

from ..command_format import CommandFormat
from ..commands import HOLD, Commands, MotorCurves
from ..sampling import held_commands
from .servos import Servo, read_servos


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
        return held_commands(curves, rate)

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write both files."""
        servos = read_servos(properties.motors, curves)
        ticks = ticks_of(commands.positions, curves, servos)
        _refuse_beyond(ticks, commands.times, curves, servos)
        start = ticks_of((commands.positions[0] if commands.start is None else commands.start)[None], curves, servos)[0]
        content = {
            "shot": curves.shot,
            "rate_hz": rate,
            "player": HOLD,
            "servos": [asdict(servo) for servo in servos],
            "start": start.tolist(),
        }
        rows = ",\n".join(f"  {json.dumps(row)}" for row in ticks.tolist())  # one line for each frame
        write_text(file, json.dumps(content, indent=1)[:-2] + f',\n "ticks": [\n{rows}\n ]\n}}\n')
        header = f"{os.path.splitext(file)[0]}.h"
        write_text(header, _header(os.path.basename(header), ticks, start, curves, rate, servos))
        return file, header

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the ticks of the JSON file as the angles at which the servos stand."""
        with open(files[0], encoding="utf-8") as stream:
            content = json.load(stream)
        try:
            servos = {entry["name"]: (k, Servo(**entry)) for k, entry in enumerate(content["servos"])}
            order, kept = zip(*(servos[name] for name in curves.names), strict=True)
            ticks = np.array([content["start"], *content["ticks"]], np.float64)[:, list(order)]
            times = np.arange(len(ticks) - 1) / float(content["rate_hz"])
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise ShotError("this file does not hold these servos", path=files[0], found=error) from error
        start, *angles = angles_of(ticks, curves, kept)
        return Commands(HOLD, times, np.array(angles), start=start)


def ticks_of(positions: Array, curves: MotorCurves, servos: Sequence[Servo]) -> NDArray[np.int64]:
    """Nearest ticks of positions, shape [n, M]."""
    scale = np.array([servo.ticks_per(motor.linear) for servo, motor in zip(servos, curves.motors, strict=True)])
    offset, centre = np.array([servo.offset for servo in servos]), np.array([servo.centre for servo in servos])
    return np.asarray(np.rint(centre + (positions - offset) * scale), np.int64)


def angles_of(ticks: Array, curves: MotorCurves, servos: Sequence[Servo]) -> Array:
    """Positions of ticks [rad or m], shape [n, M]."""
    scale = np.array([servo.ticks_per(motor.linear) for servo, motor in zip(servos, curves.motors, strict=True)])
    offset, centre = np.array([servo.offset for servo in servos]), np.array([servo.centre for servo in servos])
    return np.asarray(offset + (ticks - centre) / scale, np.float64)


def _refuse_beyond(ticks: NDArray[np.int64], times: Array, curves: MotorCurves, servos: Sequence[Servo]) -> None:
    problems = []
    for k, (servo, motor) in enumerate(zip(servos, curves.motors, strict=True)):
        beyond = np.maximum(servo.minimum - ticks[:, k], ticks[:, k] - servo.maximum)
        n = int(np.argmax(beyond))
        if beyond[n] > 0:
            problems.append(
                ShotError(
                    f"the motor leaves the range of its servo, {servo.minimum} to {servo.maximum} ticks",
                    path=motor.path,
                    attribute="export.ticks.motors",
                    found=f"{ticks[n, k]} ticks at {times[n]:.3f} s",
                    remedy="Correct centre, direction or offset of the servo, or limit the joint",
                )
            )
    raise_all(problems)


def _header(
    name: str,
    ticks: NDArray[np.int64],
    start: NDArray[np.int64],
    curves: MotorCurves,
    rate: float,
    servos: Sequence[Servo],
) -> str:
    prefix = re.sub(r"\W", "_", os.path.splitext(name)[0])
    prefix = f"_{prefix}" if prefix[:1].isdigit() else prefix
    guard = f"{prefix.upper()}_H"
    least, most = int(min(ticks.min(), start.min())), int(max(ticks.max(), start.max()))
    kinds = (("uint16_t", 0, 65535), ("int16_t", -32768, 32767), ("int32_t", -(2**31), 2**31 - 1))
    kind = next((kind for kind, low, high in kinds if low <= least and most <= high), "int64_t")
    rows = [f"    {{{', '.join(map(str, row))}}}," for row in ticks.tolist()]
    comments = [
        f" *   {k}: {servo.name}" + ("" if servo.id is None else f", id {servo.id}") for k, servo in enumerate(servos)
    ]
    return "\n".join(
        [
            f"/* Servo ticks of {curves.shot}; send row n at n / {prefix.upper()}_RATE_HZ seconds. Columns:",
            *comments,
            " */",
            f"#ifndef {guard}",
            f"#define {guard}",
            "#include <stdint.h>",
            f"#define {prefix.upper()}_RATE_HZ {rate:.12g}",
            f"#define {prefix.upper()}_FRAMES {len(ticks)}",
            f"#define {prefix.upper()}_SERVOS {len(servos)}",
            # a table in the memory of an AVR (Arduino Uno, Nano, Mega) would not fit; it stays in the flash
            "#ifdef __AVR__",
            "#include <avr/pgmspace.h>",
            f"#define {prefix.upper()}_FLASH PROGMEM",
            "#else",
            f"#define {prefix.upper()}_FLASH",
            "#endif",
            f"static const {kind} {prefix}_start[{len(servos)}] = {{{', '.join(map(str, start.tolist()))}}};",
            f"static const {kind} {prefix}_ticks[{len(ticks)}][{len(servos)}] {prefix.upper()}_FLASH = {{",
            *rows,
            "};",
            "/* The ticks of a servo in row n, on any processor. */",
            f"static inline {kind} {prefix}_at(unsigned long n, unsigned int servo)",
            "{",
            "#ifdef __AVR__",
            f"    {kind} value;",
            f"    memcpy_P(&value, &{prefix}_ticks[n][servo], sizeof value);",
            "    return value;",
            "#else",
            f"    return {prefix}_ticks[n][servo];",
            "#endif",
            "}",
            "#endif",
            "",
        ]
    )
