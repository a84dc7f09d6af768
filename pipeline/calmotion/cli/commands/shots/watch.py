"""`calmotion watch`: the shot simulated or optimised again whenever it is saved."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from calmotion.cli.options import count_of, run_options, shot_arguments, simulation_options

if TYPE_CHECKING:
    from calmotion.cli.output import Output

EXAMPLES = (
    ("calmotion watch shot.usda", "how much does it shake, after each save?"),
    ("calmotion watch shot.usda --optimize -o calm.usda", "and its cure"),
)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument("-o", "--output", metavar="LAYER", help="USD layer to write after each run")
    command.add_argument(
        "--optimize", action="store_true", help="optimise instead of simulating; a search begins with the last curves"
    )
    command.add_argument(
        "--runs", type=count_of("runs"), metavar="N", help="end after this many runs (default: until Ctrl-C)"
    )
    run_options(command)
    simulation_options(command, "as of simulate or optimize")


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.run import watch_shot

    return watch_shot(args, output)
