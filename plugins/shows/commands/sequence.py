"""`calmotion sequence`: clips that may follow one another in any order, and all transitions between them."""

from __future__ import annotations

import argparse
import shlex
from typing import TYPE_CHECKING, Any

from calmotion.cli import FAILED, INTERRUPTED, Output, conclude, count_of, length, print_table, report_options, say

from .forwarding import forwarded, forwarded_options

if TYPE_CHECKING:
    from rich.console import Console

EXAMPLES = (("calmotion sequence clips.toml -o build/repertoire", "clips and all transitions between them"),)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.add_argument("clips", metavar="CLIPS", help='TOML file: [clips] with NAME = "SHOT.usda" for each')
    command.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        required=True,
        help="folder for layers, manifests and the table of what each transition costs",
    )
    report_options(command)
    command.add_argument("--progress", action="store_true", help="print machine-readable progress to stderr")
    command.add_argument("--on", metavar="WHERE", default="local", help="as of `calmotion batch`")
    command.add_argument("--workers", metavar="N", type=count_of("workers"), help="largest number of jobs at once")
    forwarded_options(command, tempo=False)  # transitions begin and end where clips do


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli import ProgressDisplay
    from calmotion.host import SettingError

    from ..sequence.run import sequence

    if args.simulate:
        raise SettingError("a sequence is optimised", path="--simulate", remedy="Remove the option.")
    with ProgressDisplay(args.quiet, args.progress) as display:
        found = sequence(
            args.clips, args.output, arguments=forwarded(args), plugins=args.plugins, on=args.on, workers=args.workers,
            progress=display,
        )  # fmt: skip
    conclude(found.report(), [], output, None if args.quiet else _print)
    if found.interrupted:
        return INTERRUPTED
    return 0 if found.good else FAILED


def _print(report: dict[str, Any], console: Console) -> None:
    members = [*report["clips"], *report["transitions"]]
    say(console, report["verdict"])
    heads = ("length", "max before", "max after", "may be played")
    for title, rows in (("Clips", report["clips"]), ("Transitions", report["transitions"])):
        cells = [
            [
                _name(row),
                f"{row['seconds']:.2f} s",
                *("" if row[key] is None else length(row[key]) for key in ("error_before_m", "error_m")),
                row["may_be_played"],
            ]
            for row in rows
        ]
        print_table(console, title, ["name", *heads], cells)
    for member in members:
        if member["problem"]:
            say(console, f"{member['name']}: {member['problem']['problem']}")
    say(console, f"wrote {report['folder'] + '/sequence.json'}")
    layers = [member["layer"] for member in members if member["good"] and member["layer"]]
    if not report["good"]:
        say(
            console,
            "next: a longer shortest_transition in the file of clips helps where limits are exceeded, --goal accepts a "
            "larger error; the same command makes again only what has changed",
        )
    if layers:
        several = " (one for each clip and transition)" if len(layers) > 1 else ""
        command = f"calmotion export {shlex.quote(layers[0])} --to csv --rate 100 -o FILE"
        say(console, f"next: {command} writes commands for a controller{several}")


def _name(row: dict[str, Any]) -> str:
    return row["start"] if row["start"] == row["end"] else f"{row['start']} to {row['end']}"
