"""`calmotion optimize`: motor curves with which the robot does not shake."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from calmotion.cli.options import Commands, file_argument, run_options, shot_command, simulation_options

if TYPE_CHECKING:
    from calmotion.cli.output import Output


def add_to(commands: Commands) -> None:
    """Add the command."""
    command = shot_command(commands, "optimize", _run, "change the motor curves so that the robot does not shake")
    file_argument(command, "-o", "--output", metavar="LAYER", required=True, help="USD layer to write")
    run_options(command)
    simulation_options(command, "optimize supports only bdf2")


def _run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.run import run_shot
    from calmotion.workflow.commands import optimize

    return run_shot(optimize, args, output)
