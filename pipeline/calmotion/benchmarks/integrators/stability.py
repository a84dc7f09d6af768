"""Stiff and extreme scenes: each must run to its end, or be refused with a reason, without NaN.

`calmotion bench stability [--json] [--csv FILE] [--only TEXT]` simulates every case of `CASES` like a
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
from calmotion.benchmarks.common.tables import show, write_rows
from calmotion.benchmarks.integrators.outcomes import CASES, FAILED, Outcome, run_case


def print_outcomes(outcomes: Sequence[Outcome]) -> None:
    """The table for a person."""
    rows = [[o.group, o.name, o.outcome, *_numbers(o)] for o in outcomes]
    heads = ["extreme", "case", "outcome", "steps", "solves/step", "error [mm]", "gap [m]", "time [s]"]
    show("Stiff and extreme cases", heads, rows, texts=3)
    for outcome in outcomes:
        if outcome.why:
            print(f"{outcome.group}, {outcome.name}: {outcome.why}")


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
    parser.add_argument("--only", metavar="TEXT", default="", help="only cases and maps (`map load`) so named")
    options = parser.parse_args(arguments)
    begin = time.perf_counter()
    only = options.only.lower()
    outcomes = [run_case(case) for case in CASES if only in f"{case.group} {case.name}".lower()]
    maps = {name: rows for name, rows in MAPS.items() if only in f"map {name}"}
    cells = all_cells(maps)
    if options.csv:
        write_rows(options.csv, Cell, cells)
    if options.json:
        report = {"cases": [asdict(outcome) for outcome in outcomes], "cells": [asdict(cell) for cell in cells]}
        print(json.dumps(report | {"total_wall_s": time.perf_counter() - begin}))
    else:
        print_outcomes(outcomes)
        print_cells(cells)
    fates = [outcome.outcome for outcome in outcomes] + [cell.outcome for cell in cells]
    return int(FAILED in fates)


if __name__ == "__main__":
    sys.exit(main())
