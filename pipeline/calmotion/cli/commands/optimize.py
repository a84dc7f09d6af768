"""`calmotion optimize`: motor curves with which the robot does not shake."""

import argparse

from calmotion.cli import Output, quantity, run_options, shot_arguments, simulation_options
from calmotion.cli.retiming import refuse_unused_retiming, retime_options

EXAMPLES = (
    ("calmotion optimize shot.usda -o calm.usda", "the usual case"),
    ("calmotion optimize shot.usda -o calm.usda --tolerance 0.5mm", "finer"),
    ("calmotion optimize shot.usda -o calm.usda --goal 2mm", "stop when the targets are that good"),
    ("calmotion optimize shot.usda -o calm.usda --video calm.webp", "show others what changed"),
    ("calmotion optimize shot.usda -o calm.usda --retime", "slower where motors cannot follow"),
    ("calmotion optimize shot.usda -o calm.usda --bake simulated", "for viewers without physics"),
)

OPERATORS = ("fe.mesh", "retarget.optimize")


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument("-o", "--output", metavar="LAYER", required=True, help="USD layer to write")
    run_options(command)
    simulation_options(command, "optimize supports only bdf2")
    command.add_argument(
        "--goal",
        metavar="LENGTH",
        type=quantity("m", needs_unit=True, positive=True),
        help="error at the targets that is accepted after optimising, with a unit (2mm): the search ends there, and "
        "the report says where it cannot be reached (default: that of the shot, calm:retarget:goal, or none)",
    )
    retime_options(command)
    group = command.add_argument_group(
        "robust curves",
        "Robots differ from their model: calm:retarget:uncertainty:modulus, :damping, :payload and :gains.",
    )
    group.add_argument(
        "--robust",
        nargs="?",
        const="worst",
        choices=("worst", "mean"),
        help="optimise for a set of robots around the model: the one with the largest error (worst, the default), or "
        "their mean; the curves are then measured on 200 random robots",
    )
    group.add_argument("--scenarios", metavar="N", type=_count, help="number of robots in the set (default: 7)")


def _count(text: str) -> int:
    count = int(text) if text.isdigit() else 0
    if count < 3 or count % 2 == 0:
        raise argparse.ArgumentTypeError(f"{text} is not an odd number above 2: the nominal robot and pairs around it")
    return count


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.run import run_shot
    from calmotion.host import SettingError
    from calmotion.workflow.commands import optimize

    robust = args.robust or any(text.startswith("retarget.optimize.robust=") for text in args.set) or args.settings
    if args.scenarios is not None and not robust:
        raise SettingError(
            "the number of robots is that of --robust, which is not there",
            path="--scenarios",
            found=args.scenarios,
            remedy="Add --robust, or leave it out.",
        )
    if args.goal is not None and robust:
        raise SettingError(
            "a robust search has no goal: it goes on after the goal is reached on the model",
            path="--goal",
            found=f"{1e3 * args.goal:g}mm",
            remedy="Remove --goal or --robust.",
        )
    refuse_unused_retiming(args)
    return run_shot(optimize, args, output)
