"""`calmotion simulate`: the shot as animated."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from calmotion.cli.options import Commands, file_argument, run_options, shot_command, simulation_options

if TYPE_CHECKING:
    from calmotion.cli.output import Output


def add_to(commands: Commands) -> None:
    """Add the command."""
    command = shot_command(commands, "simulate", _run, "simulate the shot as animated")
    file_argument(command, "-o", "--output", metavar="LAYER", help="USD layer to write")
    command.add_argument(
        "--shaper",
        metavar="KIND",
        help="for comparison, filter the tracks: zv, zvd, zv2, zvd2 (input shapers) or lowpass",
    )
    run_options(command)
    simulation_options(
        command,
        "bdf2, newmark, generalized-alpha, rk4 or radau (default: generalized-alpha, which needs half as many steps, "
        "or bdf2 where that fails)",
    )


def _run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.run import run_shot
    from calmotion.workflow.commands import simulate

    return run_shot(simulate, args, output, shaper=args.shaper)
