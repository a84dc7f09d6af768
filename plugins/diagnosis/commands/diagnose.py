"""`calmotion diagnose`: what makes the robot shake, from a recording of it."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from calmotion.cli import (
    Output,
    assignments,
    conclude,
    html_option,
    opened_shot,
    page_of_report,
    print_table,
    progress_display,
    quantity_in,
    say,
    shot_arguments,
)

if TYPE_CHECKING:
    from rich.console import Console

EXAMPLES = (
    ("calmotion diagnose shot.usda --recording take.csv", "encoders and an accelerometer, with the robot's model"),
    ("calmotion diagnose shot.usda --recording take.csv --commands sent.csv", "and what was sent to the robot"),
    ("calmotion diagnose --recording take.csv --commands sent.csv", "signals alone"),
)
NAMES = {
    "none": "nothing", "links": "the flexible links", "servo_gains": "a servo loop", "backlash": "backlash",
    "friction": "friction", "stream": "the stream of commands", "delay": "a delay", "base": "the base",
    "ripple": "ripple of a motor or gear", "unknown": "an unknown cause",
}  # fmt: skip


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command, optional=True)
    command.add_argument(
        "--recording",
        metavar="FILE",
        action="append",
        required=True,
        help="what was recorded, as of calmotion calibrate; its clock begins with the first frame, or with --commands; "
        "may be repeated",
    )
    command.add_argument(
        "--commands",
        metavar="FILE",
        help="the commands as they were sent: a table with columns time_s and JOINT.angle, on the clock of the "
        "recordings; without it the motion of the shot",
    )
    command.add_argument(
        "--figures",
        metavar="DIR",
        help="draw motion, error and spectra, and the error over speed and torque, into this folder",
    )
    html_option(command)


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.host import open_host
    from calmotion.workflow import prepare_page, with_shot

    from ..diagnosing import diagnose
    from ..drawing import plots_of

    shot = None
    if args.shot is not None:
        args.shot = with_shot(args.shot)
        shot = opened_shot(args)
    inputs: dict[str, str] = {} if shot is None else {"shot": str(args.shot)}
    inputs |= {f"recording {k}": name.partition("@")[0] for k, name in enumerate(args.recording, start=1)}
    inputs |= {"commands": args.commands} if args.commands else {}
    host = shot.host if shot else open_host(args.plugins)
    if args.html:
        prepare_page(host, args.html, inputs)
    with progress_display(args) as display:
        made = diagnose(
            shot, args.recording, commands=args.commands, figures=args.figures, settings=assignments(args),
            progress=display, on_operator=display.done,
        )  # fmt: skip
    report = made.report()
    plots = [(heading, figure) for _, heading, figure in plots_of(made.diagnosis)] if args.html else []
    report["html"] = page_of_report(host, args.html, report, SECTIONS, inputs, plots)
    conclude(report, (), output, None if args.quiet else _print)
    return 0


def _sure(confidence: float) -> str:
    return (
        "sure"
        if confidence >= 0.95
        else "likely"
        if confidence >= 0.8
        else "perhaps"
        if confidence >= 0.5
        else "a guess"
    )


def _print_answer(report: dict[str, Any], console: Console) -> None:
    first = report["causes"][0]
    if first["cause"] == "none":
        say(console, "The robot does what was asked, within the noise of the recording: nothing shakes.")
    else:
        verb = "explain" if first["cause"] == "links" else "explains"
        say(
            console,
            f"{NAMES[first['cause']].capitalize()} {verb} {first['share']:.0%} of the error "
            f"({_sure(first['confidence'])}, {first['confidence']:.0%}).",
        )
    say(console, f"What to do: {first['remedy']}")
    if report["tells"]:
        say(console, f"A measurement {report['tells']}")
    rows = [
        [NAMES[row["cause"]], f"{row['share']:.0%}", f"{row['confidence']:.0%}", _values(row["parameters"])]
        for row in report["causes"]
    ]
    print_table(console, "Causes", ["cause", "share of the error", "confidence", "found"], rows, texts=1)
    for row in report["causes"][1:]:
        say(console, f"{NAMES[row['cause']]}: {row['remedy']}")
    rows = [
        [row["name"], *(quantity_in(row[name], row["unit"], 3) for name in ("error_rms", "noise", "unexplained_rms"))]
        for row in report["channels"]
    ]
    print_table(console, "Error (root mean square)", ["channel", "error", "noise", "not explained"], rows, texts=1)


def _print_notes(report: dict[str, Any], console: Console) -> None:
    for note in report["notes"]:
        say(console, f"note: {note}")


SECTIONS = {"Result": _print_answer, "Notes": _print_notes}


def _print(report: dict[str, Any], console: Console) -> None:
    _print_answer(report, console)
    for file in (*report["figures"], *filter(None, [report["html"]])):
        say(console, f"wrote {file}")
    _print_notes(report, console)


def _values(parameters: list[dict[str, Any]]) -> str:
    """The first values, in a few words."""
    shown = [f"{row['name'].replace('_', ' ')} {row['value']:.3g} {row['unit']}".strip() for row in parameters[:3]]
    return ", ".join(shown) + (", ..." if len(parameters) > 3 else "")
