"""`calmotion bench`: error against run time, measured."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from calmotion.cli.options import Commands

if TYPE_CHECKING:
    from calmotion.cli.output import Output

BENCHMARKS = {
    "baselines": "optimizer.baselines", "batch": "shows.batches", "calibration": "accuracy.calibration",
    "compilation": "speed.compilation", "estimates": "accuracy.estimates",
    "extremes": "integrators.extremes", "gradients": "integrators.gradients",
    "integrators": "integrators.integrators",
    "meshing": "links.meshing", "motor-commands": "motors.commands",
    "motor-cost": "motors.cost", "optimizer": "optimizer.optimizer", "reading": "speed.reading",
    "reduction": "speed.reduction", "reduction-convergence": "accuracy.reduction_convergence",
    "scaling": "speed.scaling", "sequence": "shows.repertoires", "simplification": "accuracy.simplification",
    "speed": "speed.stages", "stability": "integrators.stability",
    "tolerances": "accuracy.tolerances", "windows": "shows.windows", "work-precision": "accuracy.work_precision",
}  # fmt: skip


def add_to(commands: Commands) -> None:
    """Add the command."""
    command = commands.add_parser(
        "bench",
        help="measure error against run time",
        description="Measure error against run time. `calmotion bench NAME --help` lists the arguments of a benchmark.",
    )
    command.add_argument("name", metavar="NAME", choices=tuple(BENCHMARKS), help=", ".join(BENCHMARKS))
    command.add_argument("arguments", nargs=argparse.REMAINDER, help="arguments of the benchmark")
    command.set_defaults(command=_run, json=False)


def _run(args: argparse.Namespace, output: Output) -> int:
    from importlib import import_module

    status: int = import_module(f"calmotion.benchmarks.{BENCHMARKS[args.name]}").main(args.arguments)
    return status
