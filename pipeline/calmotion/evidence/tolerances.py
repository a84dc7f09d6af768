"""Whether `--tolerance` is kept: retargeting to a few tolerances, each result measured against a far finer simulation.

`calmotion bench tolerances [SHOT ...] [--csv FILE]` optimises each shot to each tolerance, and simulates the curves
that it finds again with a far smaller step and far more coordinates. The error is the largest distance of any target,
at any frame, between the two.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

from ..dynamics.topology import span_tree
from ..retarget.bodies import reduce_bodies
from ..retarget.prepare import Options, excitations
from ..retarget.step_error import distance, frames_of
from ..retarget.to_tolerance import found_tracks, optimize_to_tolerance
from .shots import Unreduced, load_unreduced
from .tables import write_rows
from .work_precision import SAMPLES, Bench, machine

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)


@dataclass(frozen=True)
class Kept:
    """One shot to one tolerance.

    Attributes:
        shot: Name.
        tolerance_m: Asked for [m].
        error_m, reference_m: Measured, and how far the reference may be from its limit [m].
        estimated_m: What the program estimates [m].
        step_s, coordinates: What it chose.
        wall_s: Reduction and optimisation, the mesh at hand [s].
        shake_before_m, shake_after_m: Largest error of the input and of the result against what was meant [m].
    """

    shot: str
    tolerance_m: float
    error_m: float
    reference_m: float
    estimated_m: float
    step_s: float
    coordinates: int
    wall_s: float
    shake_before_m: float
    shake_after_m: float

    @property
    def kept(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error_m <= self.tolerance_m


def kept(shot: Unreduced, tolerance: float) -> Kept:
    """Retarget a shot to a tolerance [m], and measure the result."""
    character, animation, options = shot.character, shot.animation, Options(tolerance=tolerance)
    begin = time.perf_counter()
    loads = excitations(character, animation, shot.meshes, options)
    bodies = reduce_bodies(character, span_tree(character), shot.meshes, None, loads, tolerance)
    result = optimize_to_tolerance(character, animation, bodies, options, lambda fraction, message: None)
    wall = time.perf_counter() - begin
    assert result.after is not None and result.accuracy is not None
    found = replace(animation, current=found_tracks(result, animation))
    reference, own = Bench(replace(shot, animation=found)).reference(), frames_of(result, animation.frame_times)
    return Kept(
        shot.name, tolerance, distance(own.positions, reference.positions), reference.bar_m,
        result.accuracy.estimated_m, result.step_s, sum(len(body.stiffness) for body in bodies), wall,
        *(float(run.position_errors[run.motion.judged].max()) for run in (result.before, result.after)),
    )  # fmt: skip


def print_rows(rows: Sequence[Kept]) -> None:
    """The table for a person."""
    from ..cli_tables import console_on, length, print_table

    heads = [
        "shot", "tolerance", "error", "estimate", "reference to", "step", "coordinates", "time", "shake before",
        "after",
    ]  # fmt: skip
    cells = [
        [
            row.shot, length(row.tolerance_m), length(row.error_m), length(row.estimated_m), length(row.reference_m),
            f"{1e3 * row.step_s:.3g} ms", str(row.coordinates), f"{row.wall_s:.1f} s", length(row.shake_before_m),
            length(row.shake_after_m),
        ]
        for row in rows
    ]  # fmt: skip
    print_table(console_on(sys.stdout), "Optimised to a tolerance, against a far finer simulation", heads, cells)


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 when a tolerance is not kept."""
    parser = argparse.ArgumentParser(prog="calmotion bench tolerances", description=__doc__)
    parser.add_argument("shots", metavar="SHOT", nargs="*", default=list(SAMPLES), help="USD file (default: samples)")
    parser.add_argument("--tolerances", metavar="METRES", nargs="+", type=float, default=list(TOLERANCES))
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout, and nothing else there")
    parser.add_argument("--csv", metavar="FILE", help="also write a table")
    options = parser.parse_args(arguments)
    rows: list[Kept] = []
    for path in options.shots:
        shot = load_unreduced(path)
        rows += [kept(shot, tolerance) for tolerance in options.tolerances]
        if not options.json:
            print_rows(rows[-len(options.tolerances) :])
    if options.csv:
        write_rows(options.csv, Kept, rows)
    if options.json:
        print(json.dumps({"machine": machine(), "rows": [asdict(row) | {"kept": row.kept} for row in rows]}))
    return int(not all(row.kept for row in rows))


if __name__ == "__main__":
    sys.exit(main())
