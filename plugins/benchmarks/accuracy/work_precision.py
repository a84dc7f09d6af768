"""Error against run time for all settings of the simulation, against a reference with a measured error.

`calmotion bench work-precision [SHOT ...] [--csv FILE] [--figures DIR]` simulates each shot as animated with many
settings: step and integrator, reduction, POD subspace, elastic law, and the choices of `--tolerance`. The
error is the largest distance of any target, at any frame, to a reference with a much smaller step and many more
coordinates. The error of the reference is shown as its error bar; smaller errors cannot be compared. Times are medians
of the simulation. The choices for each tolerance are compared with the fastest setting that keeps the tolerance.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict

from ..common.parsers import bench_parser, output_options, shots_argument
from ..common.shots import SAMPLES, load_unreduced
from ..common.tables import show, write_rows
from ..common.timing import machine
from . import work_precision_points
from .reference_bench import REPEATS, TOLERANCES, Bench, Point, over_fastest, setting_of
from .work_precision_figure import draw_work_precision


def print_points(points: Sequence[Point], bar: float) -> None:
    """The table of one shot for a person, and how its choices compare with the fastest settings."""
    from calmotion.cli import length

    rows = [
        [p.series, p.setting, f"1/{1 / p.step_s:.0f} s", str(p.coordinates), f"{p.wall_s:.3f} s", length(p.error_m)]
        for p in points
    ]
    heads = ["choice", "setting", "step", "coordinates", "simulation", "error"]
    show(f"{points[0].shot}: against a reference that is known to {length(bar)}", heads, rows, texts=2)
    for tolerance, (ratio, fastest) in over_fastest(points, TOLERANCES).items():
        print(
            f"{setting_of(tolerance)}: {ratio:.2f} times the run time of the fastest setting that keeps it "
            f"({fastest.series}, {fastest.setting}, {fastest.coordinates} coordinates)"
        )


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("work-precision", __doc__)
    shots_argument(parser, SAMPLES)
    output_options(parser, csv="a table")
    parser.add_argument("--figures", metavar="DIR", help="also draw error against run time, to this folder")
    parser.add_argument("--repeats", type=int, default=REPEATS, help="repetitions; times are medians")
    options = parser.parse_args(arguments)
    points: dict[str, list[Point]] = {}
    bars: dict[str, float] = {}
    figures: list[str] = []
    for path in options.shots:
        bench = Bench(load_unreduced(path), options.repeats)
        reference, name = bench.reference(), bench.shot.name
        bars[name] = reference.bar_m
        points[name] = work_precision_points.forward_points(bench, reference)
        points[name] += work_precision_points.chosen_points(bench, reference)
        if options.csv:  # the next shot may take long
            write_rows(options.csv, Point, [point for own in points.values() for point in own])
        if options.figures:
            figures.append(draw_work_precision(options.figures, points[name], bars[name]))
        if not options.json:
            print_points(points[name], bars[name])
    if options.json:
        ratios = {name: {t: r for t, (r, _) in over_fastest(own, TOLERANCES).items()} for name, own in points.items()}
        rows = [asdict(point) for own in points.values() for point in own]
        report = {"machine": machine(), "reference_error_m": bars, "points": rows, "figures": figures}
        print(json.dumps(report | {"over_fastest": ratios}))
    else:
        for figure in figures:
            print(f"wrote {figure}")
    return 0
