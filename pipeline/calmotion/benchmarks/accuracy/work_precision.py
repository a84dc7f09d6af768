"""Error against run time for all settings of the simulation, against a reference with a measured error.

`calmotion bench work-precision [SHOT ...] [--csv FILE] [--figures DIR]` simulates each shot as animated with many
settings: step and integrator, reduction, POD subspace, elastic law, elements, and the choices of `--tolerance`. The
error is the largest distance of any target, at any frame, to a reference with a much smaller step and many more
coordinates. The error of the reference is shown as its error bar; smaller errors cannot be compared. Times are medians
of the simulation. The choices for each tolerance are compared with the fastest setting that keeps the tolerance.
"""

from __future__ import annotations

import json
import os
import platform
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from calmotion.benchmarks.accuracy.pareto import over_fastest, print_over_fastest
from calmotion.benchmarks.accuracy.reference_bench import REPEATS, TOLERANCES, Bench, Point
from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.shots import load_unreduced
from calmotion.benchmarks.common.tables import write_rows

if TYPE_CHECKING:
    from calmotion.benchmarks.integrators.gradient_error import GradientError
    from calmotion.benchmarks.optimizer.optimizer import Convergence

SAMPLES = tuple(f"samples/{name}/{name}.usda" for name in ("bartender", "dancer", "rapper", "drummer", "boxer"))
LBFGS = 200  # most evaluations of the quasi-Newton method


def machine() -> dict[str, object]:
    """The machine of the measurement."""
    return {
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def print_points(points: Sequence[Point], bar: float) -> None:
    """The table of one shot for a person."""
    from calmotion.cli.quantities import length
    from calmotion.cli.tables import console_on, print_table

    rows = [
        [p.series, p.setting, f"1/{1 / p.step_s:.0f} s", str(p.coordinates), f"{p.wall_s:.3f} s", length(p.error_m)]
        for p in points
    ]
    title = f"{points[0].shot}: against a reference that is known to {length(bar)}"
    heads = ["choice", "setting", "step", "coordinates", "simulation", "error"]
    print_table(console_on(sys.stdout), title, heads, rows, texts=2)


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("work-precision", __doc__)
    parser.add_argument("shots", metavar="SHOT", nargs="*", default=list(SAMPLES), help="USD file (default: samples)")
    output_options(parser, csv="a table")
    parser.add_argument("--figures", metavar="DIR", help="also draw error against run time, to this folder")
    parser.add_argument("--elements", action="store_true", help="also vary the element size; takes long")
    parser.add_argument(
        "--optimizer",
        action="store_true",
        help="also compare both adjoints with differences, and Gauss-Newton with L-BFGS; takes long",
    )
    parser.add_argument("--repeats", type=int, default=REPEATS, help="repetitions; times are medians")
    options = parser.parse_args(arguments)
    from calmotion.benchmarks.accuracy.work_precision_points import chosen_points, element_points, forward_points

    points: list[Point] = []
    gradients: list[GradientError] = []
    converged: list[Convergence] = []
    bars: dict[str, float] = {}
    for name in options.shots:
        bench = Bench(load_unreduced(name), options.repeats)
        reference = bench.reference()
        shot_points = forward_points(bench, reference) + chosen_points(bench, reference)
        shot_points += element_points(bench) if options.elements else []
        bars[bench.shot.name] = reference.bar_m
        points += shot_points
        if options.csv:
            write_rows(options.csv, Point, points)  # the next shot may take long
        if not options.json:
            print_points(shot_points, reference.bar_m)
            print_over_fastest(shot_points, TOLERANCES)
        if options.optimizer:
            from calmotion.benchmarks.common.shots import load
            from calmotion.benchmarks.integrators.gradient_error import errors
            from calmotion.benchmarks.integrators.gradients import print_gradients
            from calmotion.benchmarks.optimizer.optimizer import compare, print_tables

            posed = load(name)
            gradients += errors(posed)
            converged += compare(posed, LBFGS)
            if not options.json:
                print_gradients(gradients, posed.name)
                print_tables(converged, [], posed.name)
    figures: list[str] = []
    if options.figures:
        from calmotion.benchmarks.accuracy.work_precision_figure import draw

        figures = [draw(options.figures, [p for p in points if p.shot == shot], bar) for shot, bar in bars.items()]
        if gradients:
            from calmotion.benchmarks.integrators.gradient_figure import draw as draw_gradients

            figures.append(draw_gradients(options.figures, gradients))
    if options.json:
        rows = [asdict(point) for point in points]
        report = {"machine": machine(), "reference_error_m": bars, "points": rows, "figures": figures}
        report["over_fastest"] = {
            shot: {
                t: ratio for t, (ratio, _) in over_fastest([p for p in points if p.shot == shot], TOLERANCES).items()
            }
            for shot in bars
        }
        if options.optimizer:
            report |= {"gradients": [asdict(r) for r in gradients], "optimizers": [asdict(r) for r in converged]}
        print(json.dumps(report))
    else:
        for figure in figures:
            print(f"wrote {figure}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
