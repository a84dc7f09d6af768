"""`calmotion simulate`: the shot as animated; `calmotion watch`: again whenever it is saved."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from calmotion.cli.options import Commands, count_of, file_argument, run_options, shot_command, simulation_options

if TYPE_CHECKING:
    from calmotion.cli.output import Output


def add_to(commands: Commands) -> None:
    """Add both commands."""
    command = shot_command(commands, "simulate", _run, "simulate the shot as animated")
    file_argument(command, "-o", "--output", metavar="LAYER", help="USD layer to write")
    command.add_argument(
        "--shaper",
        metavar="KIND",
        help="for comparison, filter the motor curves: zv, zvd, zv2, zvd2 (input shapers) or lowpass",
    )
    run_options(command)
    simulation_options(
        command,
        "bdf2, newmark, generalized-alpha, rk4 or radau (default: generalized-alpha, which needs half as many steps, "
        "or bdf2 where that fails)",
    )
    command = shot_command(commands, "watch", _watch, "simulate or optimise a shot again whenever it is saved")
    file_argument(command, "-o", "--output", metavar="LAYER", help="USD layer to write after each run")
    command.add_argument(
        "--optimize", action="store_true", help="optimise instead of simulating; a search begins with the last curves"
    )
    command.add_argument(
        "--runs", type=count_of("runs"), metavar="N", help="end after this many runs (default: until Ctrl-C)"
    )
    run_options(command)
    simulation_options(command, "as of simulate or optimize")


def _run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.run import run_shot
    from calmotion.workflow.commands import simulate

    return run_shot(simulate, args, output, shaper=args.shaper)


def _watch(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.run import watch_shot

    return watch_shot(args, output)
