"""Where each integrator is stable: the swung arm over stiffness, speed or load, and step.

`calmotion bench stability [--json] [--csv FILE] [--only TEXT]` simulates every cell of the maps by each integrator. A
cell runs to its end or is refused with a reason, without NaN. Below an integrator's boundary all smaller steps run. It
ends with exit status 1 when a cell fails.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict

from ..common.parsers import bench_parser, output_options
from ..common.tables import show, write_rows
from . import stability_map
from .stability_map import FAILED, REFUSED, RUNS, Cell, all_cells


def largest_steps(cells: Sequence[Cell]) -> dict[float, float | None]:
    """The boundary of one integrator in one map: for each value the largest step from which on all smaller ones run,
    None where the smallest does not."""
    found: dict[float, float | None] = {}
    for value in dict.fromkeys(cell.value for cell in cells):
        found[value] = None
        for cell in sorted((cell for cell in cells if cell.value == value), key=lambda cell: cell.step_s):
            if cell.outcome != RUNS:
                break
            found[value] = cell.step_s
    return found


def step_name(step: float | None) -> str:
    """A step as a fraction of a second."""
    return "none" if step is None else f"1/{round(1 / step)}"


def print_cells(cells: Sequence[Cell]) -> None:
    """The boundary of each integrator, and how many cells there are of which outcome, for a person."""
    for name in dict.fromkeys(cell.map for cell in cells):
        own = [cell for cell in cells if cell.map == name]
        lines = {
            integrator: largest_steps([cell for cell in own if cell.integrator == integrator])
            for integrator in dict.fromkeys(cell.integrator for cell in own)
        }
        values = list(dict.fromkeys(cell.value for cell in own))
        rows = [[f"{value:g}", *(step_name(line[value]) for line in lines.values())] for value in values]
        show(f"Largest stable step [s] over {name}", [name, *lines], rows, texts=0)
    for outcome in (RUNS, REFUSED, FAILED):
        count = sum(cell.outcome == outcome for cell in cells)
        print(f"{count} cells {'run' if outcome == RUNS else 'are refused' if outcome == REFUSED else 'fail'}")
    for cell in cells:
        if cell.outcome == FAILED:
            print(f"{cell.map} {cell.value:g}, {step_name(cell.step_s)} s, {cell.integrator}: {cell.why}")


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 when a cell fails."""
    parser = bench_parser("stability", __doc__)
    output_options(parser, csv="the cells as a table")
    parser.add_argument("--only", metavar="TEXT", default="", help="only maps (`load`) so named")
    options = parser.parse_args(arguments)
    begin = time.perf_counter()
    cells = all_cells({name: rows for name, rows in stability_map.MAPS.items() if options.only.lower() in name})
    if options.csv:
        write_rows(options.csv, Cell, cells)
    if options.json:
        print(json.dumps({"cells": [asdict(cell) for cell in cells], "total_wall_s": time.perf_counter() - begin}))
    else:
        print_cells(cells)
    return int(FAILED in [cell.outcome for cell in cells])
