"""`calmotion inspect`: the content of a shot, and how its model is simplified."""

import argparse
from functools import partial

from calmotion.cli import (
    FAILED,
    INTERRUPTED,
    Output,
    conclude,
    opened_shot,
    progress_display,
    run_arguments,
    shot_arguments,
    simulation_arguments,
    simulation_options,
)

EXAMPLES = (
    ("calmotion inspect shot.usda", "bodies, motors, targets, frequencies"),
    ("calmotion inspect shot.usda --meshes", "frequencies of meshes, as simulations have them"),
    ("calmotion inspect shot.usda --strict", "check before publishing"),
    ("calmotion inspect shot.usda --modes build/modes", "how the links vibrate"),
)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument(
        "--meshes",
        action="store_true",
        help="mesh the flexible bodies, which may take minutes; without it, frequencies are estimated from beams",
    )
    command.add_argument(
        "--modes",
        metavar="DIR",
        help="folder for the mode shapes of the flexible bodies (.vtu, .png) and their table; with --meshes",
    )
    command.add_argument(
        "--figures",
        metavar="DIR",
        help="folder for tempo.png: where the animation would have to be slower, and for which motors",
    )
    command.add_argument(
        "--strict",
        action="store_true",
        help="check the shot before publishing: run every cheap check and USD's validators, list all findings, and end "
        "with status 1 if there are any",
    )
    command.add_argument(
        "--live",
        action="store_true",
        help="print the error of a streamed motion for each look-ahead",
    )
    command.add_argument("--verbose", action="store_true", help="also print all simplifications and their reasons")
    simulation_options(command, "bdf2, newmark, generalized-alpha or rk4 (default: automatic)")


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.reports.inspection import print_inspection
    from calmotion.workflow.commands import inspect

    if args.live:
        from calmotion.cli.commands.table import all_commands

        status: int = all_commands()["live"].load().worth_of_lookahead(args, output)
        return status
    shot = opened_shot(args)
    with progress_display(args) as display:
        inspection = inspect(
            shot,
            strict=args.strict,
            meshes=args.meshes,
            modes=args.modes,
            figures=args.figures,
            **simulation_arguments(args),
            **run_arguments(args, display),
        )
    findings = inspection.findings
    show = None if args.quiet and not args.strict else partial(print_inspection, verbose=args.verbose)
    conclude(inspection.report(), inspection.problems, output, show)
    if inspection.interrupted:
        return INTERRUPTED
    return FAILED if inspection.problems or (findings is not None and findings.items) else 0
