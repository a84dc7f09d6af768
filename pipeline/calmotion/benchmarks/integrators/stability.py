"""Stiff and extreme scenes: each must run to its end, or be refused with a reason, without NaN.

`calmotion bench stability [--json] [--csv FILE] [--figures DIR] [--only TEXT]` simulates every case of `CASES` like a
shot, then every cell of the maps over stiffness, speed, load and step by each integrator
(`stability_map`), and prints the outcomes. It ends with exit status 1 when a case or a cell fails.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.tables import write_rows
from calmotion.benchmarks.integrators.outcomes import CASES, FAILED, Outcome, run_case


def print_outcomes(outcomes: Sequence[Outcome]) -> None:
    """The table for a person."""
    from calmotion.cli.tables import console_on, print_table

    rows = [[o.group, o.name, o.outcome, *_numbers(o)] for o in outcomes]
    heads = ["extreme", "case", "outcome", "steps", "solves/step", "error [mm]", "gap [m]", "time [s]"]
    console = console_on(sys.stdout)
    print_table(console, "Stiff and extreme cases", heads, rows, texts=3)
    for outcome in outcomes:
        if outcome.why:
            console.print(f"{outcome.group}, {outcome.name}: {outcome.why}", soft_wrap=True)


def _numbers(outcome: Outcome) -> list[str]:
    if not outcome.steps:
        return ["-"] * 5
    return [
        str(outcome.steps), f"{outcome.newton:.1f}", f"{1e3 * outcome.error_m:.3g}", f"{outcome.gap_m:.0e}",
        f"{outcome.wall_s:.2f}",
    ]  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 when a case or a cell fails."""
    from calmotion.benchmarks.integrators.stability_map import MAPS, Cell, all_cells, print_cells

    parser = bench_parser("stability", __doc__)
    output_options(parser, csv="the cells of the maps as a table")
    parser.add_argument("--figures", metavar="DIR", help="also draw the maps, to this folder")
    parser.add_argument(
        "--only",
        metavar="TEXT",
        default="",
        help="cases and maps (`map load`) whose name contains a text",
    )
    options = parser.parse_args(arguments)
    begin = time.perf_counter()
    only = options.only.lower()
    outcomes = [run_case(case) for case in CASES if only in f"{case.group} {case.name}".lower()]
    maps = {name: rows for name, rows in MAPS.items() if only in f"map {name}"}
    cells = all_cells(maps)
    figures: list[str] = []
    if options.figures and cells:
        from calmotion.benchmarks.integrators.stability_figure import draw_map

        figures = [
            draw_map(options.figures, name, rows[0], [cell for cell in cells if cell.map == name])
            for name, rows in maps.items()
        ]
    if options.csv:
        write_rows(options.csv, Cell, cells)
    if options.json:
        report = {"cases": [asdict(outcome) for outcome in outcomes], "cells": [asdict(cell) for cell in cells]}
        print(json.dumps(report | {"figures": figures, "total_wall_s": time.perf_counter() - begin}))
    else:
        print_outcomes(outcomes)
        print_cells(cells)
        for path in [*figures, *([options.csv] if options.csv else [])]:
            print(f"wrote {path}")
    fates = [outcome.outcome for outcome in outcomes] + [cell.outcome for cell in cells]
    return int(FAILED in fates)


if __name__ == "__main__":
    sys.exit(main())
