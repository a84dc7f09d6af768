"""`calmotion rig`: a robot from a skinned character, or from parts with keys."""

from __future__ import annotations

import argparse
import shlex
from typing import TYPE_CHECKING, Any

from calmotion.cli import (
    Output,
    angle,
    conclude,
    length,
    opened_shot,
    print_table,
    progress_display,
    run_arguments,
    say,
    shot_arguments,
)

if TYPE_CHECKING:
    from rich.console import Console

EXAMPLES = (
    ("calmotion rig skinned.usda -o robot.usda", "a robot from a UsdSkel character"),
    ("calmotion rig parts.usda -o robot.usda", "a robot from meshes under Xforms with keys"),
    ("calmotion rig skinned.usda -o robot.usda --set rig.skeleton.flexible=all", "with links that bend"),
)
OPERATORS = ("rig.skeleton",)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument("-o", "--output", metavar="LAYER", required=True, help="USD layer to write, over the shot")


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.workflow.commands import rig
    from calmotion.workflow.report import rig_report

    shot = opened_shot(args)
    with progress_display(args) as display:
        made = rig(shot, args.output, **run_arguments(args, display))
    conclude(rig_report(made), (), output, None if args.quiet else _print)
    return 0


def _print(report: dict[str, Any], console: Console) -> None:
    say(
        console,
        f"{report['robot']}: {report['bodies']} bodies, {report['motors']} motors, {report['mass_kg']:.4g} kg; "
        f"largest residual angle {angle(report['max_angle_error_rad'])}"
        + (f", largest distance {length(report['max_error_m'])}" if report["max_error_m"] else ""),
    )
    rows = [
        [j["joint"].split("/")[-1], j["body"], str(len(j["motors"])), angle(j["angle_error_rad"])]
        for j in report["joints"]
    ]
    print_table(console, "Moving joints", ["joint", "body", "hinges", "residual angle"], rows, texts=2)
    for note in report["notes"]:
        say(console, note)
    for target in report["targets"]:
        say(console, f"target: {target}")
    say(console, f"wrote {report['layer']}, which is a shot")
    if not report["flexible"]:
        say(console, "all links are rigid: apply CalmFlexibleBodyAPI, or add --set rig.skeleton.flexible=all")
    say(console, f"next: calmotion inspect {shlex.quote(report['layer'])} shows how stiff it is")
