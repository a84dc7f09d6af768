"""`calmotion export`: the motor curves as commands for a controller, with what playing them costs."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from calmotion.cli import (
    FAILED,
    Output,
    conclude,
    counted,
    length,
    motion_option,
    opened_shot,
    print_table,
    progress_display,
    quantity,
    run_arguments,
    say,
    shot_arguments,
    tolerance_option,
    up_to,
)

if TYPE_CHECKING:
    from rich.console import Console

EXAMPLES = (
    ("calmotion export calm_root.usda --to csv --rate 200Hz", "a table for any controller"),
    ("calmotion export calm_root.usda --to ros2 -o trajectory.yaml", "a ROS 2 JointTrajectory"),
)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument(
        "--to",
        metavar="FORMAT",
        required=True,
        help="format: ros2, csv, ticks (servos), ur, bottango, or that of a plugin",
    )
    command.add_argument("--rate", metavar="HZ", type=_rate, default=100.0, help="commands a second (default: 100)")
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="file to write; replaces one of that name (default: named after the shot, in this folder)",
    )
    command.add_argument(
        "--start-delay",
        metavar="TIME",
        type=quantity("s"),
        default=0.0,
        help="how late the controller starts, in s or with a unit (5ms); it counts as loss",
    )
    tolerance_option(command)
    command.add_argument(
        "--allowed-loss",
        metavar="LENGTH",
        type=quantity("m", needs_unit=True, positive=True),
        help="error that playing the commands may add at the targets, with a unit (2mm; default: the tolerance)",
    )
    command.add_argument(
        "--no-search", action="store_true", help="do not look for the lowest rate that keeps the allowed loss"
    )
    motion_option(command)
    command.add_argument(
        "--strict", action="store_true", help="exit with status 1 if the commands lose more than is allowed"
    )


def _rate(text: str) -> float:
    from .commands import HIGHEST_RATE, LOWEST_RATE

    value = quantity("Hz")(text)
    if not LOWEST_RATE <= value <= HIGHEST_RATE:
        raise argparse.ArgumentTypeError(f"{text} is not {LOWEST_RATE:g} to {HIGHEST_RATE:g} commands a second")
    return value


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.workflow import with_shot

    from .exporting import export

    args.shot = with_shot(args.shot)
    shot = opened_shot(args)
    with progress_display(args) as display:
        made = export(
            shot, args.output, to=args.to, rate=args.rate, start_delay=args.start_delay, tolerance=args.tolerance,
            allowed_loss=args.allowed_loss, search=not args.no_search, **run_arguments(args, display),
        )  # fmt: skip
    conclude(made.report(), (), output, None if args.quiet else _print)
    return FAILED if args.strict and not made.loss_kept else 0


def _print(report: dict[str, Any], console: Console) -> None:
    allowed, kept, lowest = length(report["allowed_loss_m"]), report["loss_kept"], report["lowest_rate_hz"]
    say(
        console,
        f"Playing the commands costs {up_to(report['max_loss_m'])} at the targets, "
        f"{'within' if kept else 'more than'} the allowed {allowed}.",
    )
    if report["searched"] and lowest:
        say(console, f"The lowest rate that keeps it: {lowest} Hz.")
    for file in report["files"]:
        say(console, f"wrote {file}")
    if kept:
        say(console, "next: the page 'Exporting for a controller' of the documentation says how the file is played")
    elif lowest:
        say(console, f"next: the same command with --rate {lowest}")
    elif report["searched"]:
        say(
            console,
            "next: no rate is enough, since rounding and a late start alone cost more than is allowed: use servos with "
            "more ticks, smaller steps or an earlier start",
        )
    heads = ["target", "rate", "rounding", "start delay", "in all"]
    rows = [
        [row["path"], *(length(row[key]) for key in ("rate_loss_m", "rounding_loss_m", "start_loss_m", "loss_m"))]
        for row in report["targets"]
    ]
    print_table(console, "What playing the commands costs at the targets, at most", heads, rows)
    ways = {"hold": "is held", "linear": "is followed along lines", "cubic": "is followed along cubics"}
    ways |= {"bezier": "is followed along Bezier curves", "follow": "is followed as the controller does"}
    way = ways.get(report["interpolation"], "is followed along quintics")
    say(
        console,
        f"{report['commands']} commands at {report['rate_hz']:g} Hz for {counted(len(report['motors']), 'motor')}; "
        f"each {way}; {report['simulations']} simulations with steps of {1e3 * report['step_s']:.3g} ms",
    )
    slowest = max((row["delay_cost_m_per_s"] for row in report["targets"]), default=0.0)
    say(console, f"each millisecond by which the controller starts late costs {up_to(1e-3 * slowest)}")
    for note in report["notes"]:
        say(console, f"note: {note}")
