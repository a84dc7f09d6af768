"""`calmotion simulate`: the shot as animated."""

import argparse

from calmotion.cli import Output, run_options, shot_arguments, simulation_options

EXAMPLES = (
    ("calmotion simulate shot.usda", "how much does it shake as animated?"),
    ("calmotion simulate shot.usda --rrd shake.rrd", "look at it: rerun shake.rrd"),
    ("calmotion simulate shot.usda --shaper zvd", "what would an input shaper give?"),
)

OPERATORS = ("fe.mesh",)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument("-o", "--output", metavar="LAYER", help="USD layer to write")
    command.add_argument(
        "--shaper",
        metavar="KIND",
        help="for comparison, filter the motor curves: zv, zvd, ei or mzv (input shapers; zv2, ... for two modes), "
        "or lowpass",
    )
    run_options(command)
    simulation_options(
        command,
        "bdf2, newmark, generalized-alpha or rk4 (default: generalized-alpha, which needs half as many steps, "
        "or bdf2 where that fails)",
    )


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.run import run_shot
    from calmotion.workflow.commands import simulate

    return run_shot(simulate, args, output, shaper=args.shaper)
