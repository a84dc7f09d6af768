"""Convergence of the reduction: change of the targets when only its tolerance decreases by a factor of ten.

`calmotion bench reduction-convergence [SHOT ...] [--csv FILE] [--markdown FILE]` reduces each shot to ever smaller
tolerances, and simulates it as animated with all coordinates and one step. The error of a reduction is estimated for
each body at rest; this measures its effect on the motion. If a series does not decrease, the deflections are
too large for a basis of modes and modal derivatives.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from calmotion.accuracy.step_error import distance
from calmotion.benchmarks.accuracy.reference_bench import FINEST, Bench
from calmotion.benchmarks.accuracy.work_precision import SAMPLES, machine
from calmotion.benchmarks.common.parsers import table_parser
from calmotion.benchmarks.common.tables import markdown, write_rows

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, FINEST)
STEP, INTEGRATOR = 1 / 240, "generalized-alpha"
SEEN = 1e-6  # reductions finer than this see pairs of coordinates as for this [m]: more costs most of the time


@dataclass(frozen=True)
class ConvergenceRow:
    """One reduction of one shot.

    Attributes:
        shot: Name.
        tolerance_m: Of the reduction [m].
        coordinates: Elastic ones of the flexible bodies, from the fewest to the most.
        moved_m: Largest distance of any target, at any frame, to where the reduction before has it [m]; None for the
            first.
        run_s: Time of the simulation [s].
    """

    shot: str
    tolerance_m: float
    coordinates: str
    moved_m: float | None
    run_s: float


def convergence(bench: Bench, tolerances: Sequence[float] = TOLERANCES) -> Iterator[ConvergenceRow]:
    """Reductions to one tolerance [m] after another, each as it is measured."""
    before = None
    for tolerance in tolerances:
        bodies = bench.bodies(tolerance, pairs_share=max(1.0, SEEN / tolerance))
        begin = time.perf_counter()
        positions = bench.run(bodies, STEP, INTEGRATOR).positions
        took = time.perf_counter() - begin
        moved = None if before is None else distance(positions, before)
        counts = sorted(len(body.stiffness) for body in bodies if len(body.stiffness))
        yield ConvergenceRow(bench.shot.name, tolerance, ", ".join(map(str, counts)), moved, took)
        before = positions


HEADS = ("shot", "reduced to", "moved", "coordinates", "simulation")


def cells(rows: Sequence[ConvergenceRow]) -> list[list[str]]:
    """The table for a person, without its heads."""
    from calmotion.cli.quantities import length

    return [
        [row.shot, length(row.tolerance_m), length(row.moved_m), row.coordinates, f"{row.run_s:.2f} s"] for row in rows
    ]


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    from calmotion.benchmarks.common.shots import load_unreduced

    options = table_parser("reduction-convergence", __doc__, SAMPLES, TOLERANCES).parse_args(arguments)
    rows: list[ConvergenceRow] = []
    for path in options.shots:
        for row in convergence(Bench(load_unreduced(path)), options.tolerances):
            rows.append(row)
            print(", ".join(cells([row])[0]), file=sys.stderr, flush=True)  # the next may take long
            if options.csv:
                write_rows(options.csv, ConvergenceRow, rows)
    if options.markdown:
        Path(options.markdown).write_text(markdown(HEADS, cells(rows)), encoding="utf-8")
    if options.json:
        print(json.dumps({"machine": machine(), "rows": [asdict(row) for row in rows]}))
    else:
        from calmotion.cli.tables import console_on, print_table

        title = f"How far targets move as reductions get finer, by steps of 1/{1 / STEP:.0f} s"
        print_table(console_on(sys.stdout), title, HEADS, cells(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
