"""`calmotion motors`: the table of real motors."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from calmotion.cli import Output, console_on, json_option, print_table, say
from calmotion.model.motor import Coulomb

if TYPE_CHECKING:
    from calmotion.catalogs.motor_types import MotorType

EXAMPLES = (("calmotion motors xm430-w350", "one motor, each value with its source"),)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.add_argument("name", nargs="?", metavar="NAME", help="show only this motor, each value with its source")
    command.add_argument(
        "--motors",
        metavar="FILE",
        action="append",
        default=[],
        help="TOML file with more motors, to check it; shots use those of motors.toml in the configuration folder",
    )
    json_option(command)
    command.add_argument("--toml", action="store_true", help="print TOML, to be changed and saved as motors.toml")


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.catalogs.motor_types import likely_motor_types, motor_type_named, motor_types
    from calmotion.errors import ShotError

    known: Mapping[str, MotorType] = motor_types(args.motors)
    if args.name:
        found = motor_type_named(args.name, known)
        if found is None:
            remedy = likely_motor_types(args.name, known)
            raise ShotError("there is no such motor", found=args.name, remedy=remedy)
        known = {found.name: found}
    if args.json:
        output.object({"command": "motors", "motors": {name: _row(motor) for name, motor in known.items()}})
    elif args.toml:
        print("\n".join(map(_as_toml, known.values())), file=output.stream, end="")
    elif args.name:
        _print_one(next(iter(known.values())), output)
    else:
        _print(known, output)
    return 0


def _row(motor: MotorType) -> dict[str, Any]:
    """A motor for programs: values in SI, with their units and sources."""
    from calmotion.catalogs.motor_types import QUANTITIES

    units = {name: QUANTITIES[name].linear_si if motor.linear else QUANTITIES[name].si for name in motor.values}
    return {
        "title": motor.title,
        "group": motor.group,
        "aliases": list(motor.aliases),
        "linear": motor.linear,
        "friction_model": motor.law or Coulomb.name,
        "values": {
            name: {"value": value, "unit": units[name], "source": motor.sources[name]}
            for name, value in motor.values.items()
        },
    }


def _as_toml(motor: MotorType) -> str:
    def text(value: Any) -> str:
        return json.dumps(value, ensure_ascii=False)

    lines = [f"[{motor.name}]", f"title = {text(motor.title)}", f"group = {text(motor.group)}"]
    lines += [f"aliases = {text(list(motor.aliases))}"] if motor.aliases else []
    lines += ["linear = true"] if motor.linear else []
    lines += [f"friction_model = {text(motor.law)}"] if motor.law else []
    lines += [f"{name} = {float(f'{motor.in_table(name):.12g}')!r}" for name in motor.values]
    lines += [f"[{motor.name}.sources]", *(f"{name} = {text(motor.sources[name])}" for name in motor.values)]
    return "\n".join(lines) + "\n"


def _cell(motor: MotorType, name: str) -> str:
    return f"{motor.in_table(name):.4g} {motor.unit(name)}".strip() if name in motor.values else "-"


def _speed_of(motor: MotorType) -> str:
    """Which speed of a motor is known: without load, or else the largest."""
    return "no_load_speed" if "no_load_speed" in motor.values else "max_speed"


def _print(known: Mapping[str, MotorType], output: Output) -> None:
    console = console_on(output.stream)
    for group in dict.fromkeys(motor.group for motor in known.values()):
        cells = [
            [name, motor.title, _cell(motor, "max_torque"), _cell(motor, _speed_of(motor))]
            for name, motor in known.items()
            if motor.group == group
        ]
        print_table(console, f"{group}s".capitalize(), ["name", "motor", "largest torque", "speed"], cells, texts=2)
    say(console, "calmotion motors NAME shows all values of a motor with their sources")
    say(console, "next: name the motor of a joint in calm:motor:type, with calm:motor:model = servo")


def _print_one(motor: MotorType, output: Output) -> None:
    from calmotion.catalogs.motor_types import QUANTITIES

    console = console_on(output.stream)
    names = ", ".join([motor.name, *motor.aliases])
    sources = list(dict.fromkeys(motor.sources.values()))
    rows = [
        [QUANTITIES[name].title, f"[{sources.index(motor.sources[name]) + 1}]", _cell(motor, name)]
        for name in motor.values
    ]
    print_table(console, f"{names}: {motor.title}", ["quantity", "source", "value"], rows, texts=2)
    for number, source in enumerate(sources):
        say(console, f"[{number + 1}] {source}")
    # terms of the laws of friction come last: a motor without them has Coulomb friction
    plain = list(QUANTITIES)[: list(QUANTITIES).index("stribeck")]
    unknown = [QUANTITIES[name].title for name in plain if name not in motor.values]
    if unknown:
        say(console, f"not known: {'; '.join(unknown)}")
