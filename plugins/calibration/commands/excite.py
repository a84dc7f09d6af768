"""`calmotion excite`: a test motion that makes the parameters of the robot identifiable."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from calmotion.cli import (
    Output,
    conclude,
    count_of,
    counted,
    length,
    opened_shot,
    print_table,
    progress_display,
    quantity,
    quantity_in,
    run_arguments,
    say,
    shot_arguments,
)

from .calibrate import parameter_arguments, prior_option

if TYPE_CHECKING:
    from rich.console import Console

EXAMPLES = (
    ("calmotion excite shot.usda -o test.usda", "accelerometers at the targets, encoders"),
    ("calmotion excite shot.usda -o test.usda --sensor marker=0.3mm --duration 3s", "markers"),
)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument(
        "-o",
        "--output",
        metavar="LAYER",
        required=True,
        help="USD layer to write; it opens the shot with the motion",
    )
    command.add_argument(
        "--sensor",
        metavar="KIND[@/PRIM][=NOISE]",
        action="append",
        default=[],
        help="what will record it: marker, accelerometer, angle or effort, at all targets or motors or at a prim, with "
        "the standard deviation of its noise in SI or with a unit; may be repeated (default: accelerometer and angle)",
    )
    command.add_argument(
        "--parameters", metavar="KIND", nargs="+", help="what is to be estimated, as of calmotion calibrate"
    )
    prior_option(command)
    command.add_argument(
        "--duration",
        metavar="TIME",
        type=quantity("s", positive=True),
        default=4.0,
        help="length of the motion; a second of rest behind it counts as well (default: 4 s)",
    )
    command.add_argument(
        "--amplitude",
        metavar="ANGLE",
        type=quantity("rad", positive=True),
        default=None,
        help="largest excursion of a hinge from the first pose, in rad or with a unit (default: 10deg)",
    )
    command.add_argument(
        "--tries",
        metavar="N",
        type=count_of("motions"),
        default=1000,
        help="number of motions that are compared (default: 1000)",
    )
    command.add_argument(
        "--step", metavar="TIME", type=quantity("s", positive=True), help="time step of the simulations"
    )


def run(args: argparse.Namespace, output: Output) -> int:
    from ..workflow.excite import SENSORS, excite

    shot = opened_shot(args)
    with progress_display(args) as display:
        made = excite(
            shot, layer=args.output, sensors=args.sensor or SENSORS, **parameter_arguments(args),
            duration=args.duration, amplitude=args.amplitude or "10deg",
            tries=args.tries, step=args.step, **run_arguments(args, display),
        )  # fmt: skip
    conclude(made.report(), (), output, None if args.quiet else _print)
    return 0


def _print(report: dict[str, Any], console: Console) -> None:
    told = sum(row["identifiable"] for row in report["parameters"])
    say(console, f"A recording of this motion identifies {told} of {counted(len(report['parameters']), 'parameter')}.")
    rows = [
        [
            row["kind"], row["path"], quantity_in(row["value"], row["unit"]),
            *(quantity_in(value, row["unit"], 3) for value in (
                row["prior"]["standard_deviation"], row["standard_deviation_chirp"], row["standard_deviation"]
            )),
            "yes" if row["identifiable"] else "no",
        ]
        for row in report["parameters"]
    ]  # fmt: skip
    print_table(
        console,
        "Standard deviations to expect",
        ["parameter", "of", "in the shot", "before", "after a chirp", "after this motion", "identifiable"],
        rows,
        texts=2,
    )
    say(console, f"wrote {report['layer']}")
    say(
        console,
        f"next: play it on the robot (calmotion export {report['layer']} writes commands), record it, and "
        f"calmotion calibrate {report['layer']} --recording FILE -o LAYER",
    )
    rows = [
        [
            row["path"],
            *(f"{row[name]:.3g}" for name in ("excursion", "velocity", "acceleration", "effort")),
            f"{max(row[f'{name}_share'] for name in ('range', 'velocity', 'acceleration', 'effort')):.0%}",
        ]
        for row in report["motors"]
    ]
    print_table(
        console,
        "What the motors do (rad or m, s, N m or N)",
        ["motor", "excursion", "velocity", "acceleration", "effort", "of its limits"],
        rows,
    )
    say(console, f"{report['motions']} motions compared in {report['wall_s']:.3g} s")
    for text in _collisions(report):
        say(console, text)


def _collisions(report: dict[str, Any]) -> list[str]:
    """What is known of collisions."""

    told, unchecked = [], report["unchecked_pairs"]
    if report["clearances"]:
        nearest = min(report["clearances"], key=lambda row: row["least_m"])
        one, other = nearest["bodies"]
        least = length(nearest["least_m"])
        told.append(f"bodies of the robot that no joint connects stay {least} apart or more ({one} and {other})")
    if unchecked:
        pairs = ", ".join(f"{one} and {other}" for one, other in unchecked[:3])
        more = f" and {len(unchecked) - 3} more pairs" if len(unchecked) > 3 else ""
        told.append(f"not checked for collisions, almost touching in the first pose or in closed chains: {pairs}{more}")
    return [*told, "collisions with what is not a body of the robot are not checked: look at the motion first"]
