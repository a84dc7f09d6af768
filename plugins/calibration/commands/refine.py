"""`calmotion refine`: better curves for the next take from a recording of this one."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from calmotion.cli import (
    Output,
    conclude,
    length,
    measured,
    opened_shot,
    print_table,
    progress_display,
    quantity,
    quantity_in,
    run_arguments,
    say,
    shot_arguments,
    tolerance_option,
)

from .calibrate import parameter_arguments, prior_option

if TYPE_CHECKING:
    from rich.console import Console

EXAMPLES = (
    ("calmotion refine take1_root.usda --recording take1.csv -o take2.usda", "better curves for the second one"),
    ("calmotion refine take2_root.usda --recording take2.csv -o take3.usda", "and for the third one"),
)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument(
        "--recording",
        metavar="FILE",
        action="append",
        required=True,
        help="recording of this take, as of calmotion calibrate; may be repeated",
    )
    command.add_argument(
        "-o",
        "--output",
        metavar="LAYER",
        required=True,
        help="USD layer with the curves of the next take; the model goes beside it as <stem>_model.usda",
    )
    command.add_argument("--parameters", metavar="KIND", nargs="+", help="what is estimated, as of calmotion calibrate")
    prior_option(command)
    tolerance_option(command)
    command.add_argument(
        "--step", metavar="TIME", type=quantity("s", positive=True), help="first time step of the calibration"
    )


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.workflow import with_shot

    from ..workflow.refine import refine

    args.shot = with_shot(args.shot)
    shot = opened_shot(args)
    with progress_display(args) as display:
        made = refine(
            shot, args.recording, layer=args.output, **parameter_arguments(args),
            tolerance=args.tolerance, step=args.step, **run_arguments(args, display),
        )  # fmt: skip
    conclude(made.report(), (), output, None if args.quiet else _print)
    return 0


def _print(report: dict[str, Any], console: Console) -> None:
    played, expected = (
        max((row[name] for row in report["targets"]), default=0.0)
        for name in ("max_error_played_m", "expected_max_error_m")
    )
    say(
        console,
        f"The largest error of take {report['take']} is {length(played)}; the new curves should leave "
        f"{length(expected)}.",
    )
    rows = [
        [
            row["path"],
            length(row["max_error_played_m"]),
            length(row["max_error_m"]),
            length(row["expected_max_error_m"]),
            length(row["expected_p95_max_error_m"]),
        ]
        for row in report["targets"]
    ]
    print_table(
        console,
        "Largest error at the targets",
        ["target", f"of take {report['take']}", "of the new curves", "to expect (median)", "95%"],
        rows,
    )
    rows = [
        [
            row["name"],
            quantity_in(row["prior"]["value"], row["unit"]),
            *measured(row["value"], row["standard_deviation"], row["unit"]),
            "yes" if row["identifiable"] else "no",
        ]
        for row in report["parameters"]
        if row["of_robot"]
    ]
    print_table(
        console,
        f"The robot after take {report['take']}",
        ["parameter", "before", "now", "standard deviation", "identifiable"],
        rows,
    )
    for file in (report["layer"], report["root"], report["model"], report["model_root"]):
        if file:
            say(console, f"wrote {file}")
    say(
        console,
        f"next: play {report['root']} in take {report['take'] + 1}, record it, and run calmotion refine again",
    )
    for note in report["notes"]:
        say(console, f"note: {note}")
