"""`calmotion bench`: error against run time, measured."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from calmotion.cli.parser import entry

if TYPE_CHECKING:
    from calmotion.cli.output import Output

WHAT = {
    "tolerances": ("accuracy.tolerances", "measured error of shots that are simulated or optimised to a tolerance"),
    "estimates": ("accuracy.estimates", "estimated against measured error, on random shots"),
    "work-precision": ("accuracy.work_precision", "error against run time of every setting"),
    "reduction-convergence": ("accuracy.reduction_convergence", "what a finer reduction changes"),
    "simplification": ("accuracy.simplification", "gain and error of each model simplification"),
    "calibration": ("accuracy.calibration", "known parameters of random arms, found from noisy recordings"),
    "takes": ("accuracy.takes", "a robot that is not the model, recorded and refined, take by take"),
    "meshing": ("links.meshing", "links of robots: their solids, meshes, frequencies and errors"),
    "mesh-spread": ("links.spread", "frequencies of links on meshes that follow their surfaces less and more closely"),
    "mesh-extrapolation": ("links.extrapolation", "links on ever finer meshes: what extrapolations claim and leave"),
    "interface-extrapolation": ("links.interfaces", "the same for interfaces of shots' bodies"),
    "integrators": ("integrators.integrators", "orders and numerical damping of the integrators"),
    "stability": ("integrators.stability", "stiff and extreme scenes"),
    "extremes": ("integrators.extremes", "hard scenes, growth of the cost, energy and momentum in long runs"),
    "gradients": ("integrators.gradients", "both adjoints against differences"),
    "speed": ("speed.stages", "where the time of a run goes"),
    "scaling": ("speed.scaling", "growth of the run time; a sparse solver, Exudyn, MuJoCo"),
    "sizes": ("speed.sizes", "growth of whole runs with bodies, motors and frames"),
    "reduction": ("speed.reduction", "time, memory and accuracy of a reduction"),
    "compilation": ("speed.compilation", "what a first run compiles"),
    "reading": ("speed.reading", "which robots of a folder load"),
    "optimizer": ("optimizer.optimizer", "Gauss-Newton and a quasi-Newton method"),
    "baselines": ("optimizer.baselines", "input shapers, a filter and the optimised curves"),
    "motor-commands": ("motors.commands", "optimised commands of servos, replayed in MuJoCo"),
    "motor-cost": ("motors.cost", "time of a step with motors that give"),
    "windows": ("shows.windows", "time and memory of long performances"),
    "sequence": ("shows.repertoires", "clips with all their transitions"),
    "batch": ("shows.batches", "shots on a Dask cluster of this machine"),
}  # fmt: skip
BENCHMARKS = {name: module for name, (module, _) in WHAT.items()}

EXAMPLES = (("calmotion bench work-precision", "error against run time of every setting"),)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.description = f"{command.description} `calmotion bench NAME --help` lists the arguments of one."
    command.add_argument("name", metavar="NAME", choices=tuple(BENCHMARKS), help="a benchmark, see below")
    lines = [line for name, (_, text) in WHAT.items() for line in entry(name, text, max(map(len, WHAT)) + 4)]
    command.add_argument_group("benchmarks", "\n".join(lines))
    command.add_argument("arguments", nargs=argparse.REMAINDER, help="arguments of the benchmark")


def run(args: argparse.Namespace, output: Output) -> int:
    from importlib import import_module

    status: int = import_module(f"calmotion.benchmarks.{BENCHMARKS[args.name]}").main(args.arguments)
    return status
