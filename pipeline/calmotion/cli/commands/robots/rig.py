"""`calmotion rig`: a robot from a skinned character."""

from __future__ import annotations

import argparse
import shlex
from typing import TYPE_CHECKING, Any, TextIO

from calmotion.cli.options import opened_shot, progress_display, run_arguments, shot_arguments

if TYPE_CHECKING:
    from calmotion.cli.output import Output

EXAMPLES = (("calmotion rig skinned.usda -o robot.usda", "a robot from a UsdSkel character"),)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument("-o", "--output", metavar="LAYER", required=True, help="USD layer to write, over the shot")


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.output import conclude
    from calmotion.workflow.commands import rig
    from calmotion.workflow.report import rig_report

    shot = opened_shot(args)
    with progress_display(args) as display:
        made = rig(shot, args.output, **run_arguments(args, display))
    conclude(rig_report(made), (), output, None if args.quiet else _print)
    return 0


def _print(report: dict[str, Any], stream: TextIO) -> None:
    from calmotion.cli.quantities import angle
    from calmotion.cli.tables import console_on, print_table, say

    console = console_on(stream)
    say(
        console,
        f"{report['robot']}: {report['bodies']} bodies, {report['motors']} motors, {report['mass_kg']:.4g} kg; "
        f"largest residual angle {angle(report['max_angle_error_rad'])}",
    )
    rows = [
        [j["joint"].split("/")[-1], j["body"], str(len(j["motors"])), angle(j["angle_error_rad"])]
        for j in report["joints"]
    ]
    print_table(console, "Rotating joints", ["joint", "body", "hinges", "residual angle"], rows, texts=2)
    for target in report["targets"]:
        say(console, f"target: {target}")
    say(console, f"wrote {report['layer']}, which is a shot")
    if not report["flexible"]:
        say(console, "all links are rigid: apply CalmFlexibleBodyAPI, or add --set rig.skeleton.flexible=all")
    say(console, f"next: calmotion inspect {shlex.quote(report['layer'])} shows how stiff it is")
