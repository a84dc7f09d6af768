"""Measured errors of shots that are simulated or optimised with `--tolerance`, against a finer simulation.

`calmotion bench tolerances [SHOT ...] [--csv FILE]` simulates each shot as animated with each tolerance, with the
choices of the program, and measures the result against a simulation without simplifications, with a much smaller step,
many more coordinates, and meshes of eight times the nodes. With `--optimize` it optimises each shot, and simulates the
optimised curves again. The error is the largest distance of any target, at any frame, between the two. `--resume` keeps
the rows that the CSV file has; meshes and reductions of references stay in the cache.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

from calmotion.cli import quantity
from calmotion.model import Result, RunSettings
from calmotion.retargeting import optimize_to_tolerance
from calmotion.simulation import compile_shot, reduction_for
from calmotion.testing import fresh_cache
from calmotion.tolerance import (
    analyse,
    converged_reduction,
    distance,
    found_tracks,
    frames_of_result,
    simulate_to_tolerance,
)

from ..common.parsers import bench_parser, output_options, shots_argument
from ..common.shots import SAMPLES, Unreduced, load_unreduced
from ..common.tables import finish, resumed_rows, say, write_rows
from ..common.timing import machine
from .reference_bench import FINEST, TIMES, Bench, Reference

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)
# tolerance of the reference's reduction over the tightest that is measured; where it has finer meshes, these are known
# far worse, and most of their time is that of the reduction
FINER, FINER_MESHED = 1e-2, 1e-1


@dataclass(frozen=True)
class Kept:
    """One shot to one tolerance.

    Attributes:
        shot, command: Name; `simulate` or `optimize`.
        tolerance_m: Asked for [m].
        error_m, reference_m: Measured, and how far the reference may be from its limit [m].
        estimated_m: What the program estimates [m].
        step_s, coordinates: What it chose.
        wall_s: Analysis, reduction, choices and the run, the mesh at hand [s].
        run_s: The simulation or the search alone [s].
        shake_before_m, shake_after_m: Largest error of the input and of the result against the intended motion [m].
    """

    shot: str
    command: str
    tolerance_m: float
    error_m: float
    reference_m: float
    estimated_m: float
    step_s: float
    coordinates: int
    wall_s: float
    run_s: float
    shake_before_m: float
    shake_after_m: float

    @property
    def kept(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error_m <= self.tolerance_m


class Tolerances:
    """One shot to several tolerances; the reference of its input is made once.

    Args:
        shot: The shot.
        finest: Tolerance of the reference's reduction [m], far below those that are measured.
        nodes: Nodes of the reference's meshes over those of the shot's.
    """

    def __init__(self, shot: Unreduced, finest: float = FINEST, nodes: float = TIMES):
        self.shot, self.finest, self.nodes = shot, finest, nodes
        self._bench: Bench | None = None
        self._reference: Reference | None = None

    def warm(self, tolerance: float, command: str) -> None:
        """Run once, so that what is timed afterwards neither compiles nor loads kernels."""
        with fresh_cache():
            self._run(RunSettings(tolerance=tolerance), command)

    def kept(self, tolerance: float, command: str = "simulate") -> Kept:
        """Simulate or retarget the shot to a tolerance [m], and measure the result."""
        shot, animation = self.shot, self.shot.animation
        begin = time.perf_counter()
        with fresh_cache():
            result, coordinates, more = self._run(RunSettings(tolerance=tolerance), command)
        wall = time.perf_counter() - begin
        assert result.accuracy is not None
        self._bench = self._bench or Bench(shot, nodes=self.nodes)
        if result.after is None:
            reference = self._reference = self._reference or self._bench.reference(self.finest)
        else:
            found = replace(animation, current=found_tracks(result, animation))
            reference = self._bench.of(found).reference(self.finest)
        estimated = result.accuracy.estimated_m + (result.accuracy.mesh_m or 0.0)
        runs = (result.before, result.after or result.before)
        return Kept(
            shot.name, command, tolerance,
            distance(frames_of_result(result, animation.frame_times).positions, reference.positions), reference.bar_m,
            estimated + more, result.step_s, coordinates, wall, result.wall_s,
            *(float(run.position_errors[run.motion.judged].max()) for run in runs),
        )  # fmt: skip

    def _run(self, options: RunSettings, command: str) -> tuple[Result, int, float]:
        """The result, its elastic coordinates, and the estimated error of the model simplifications [m]."""
        shot, animation, search = self.shot, self.shot.animation, command == "optimize"
        choices = analyse(shot.character, animation, options, {}, search)
        more = sum(row.estimated_error_m or 0.0 for row in choices.left_out)
        quiet = lambda fraction, message: None  # noqa: E731  (a callback, twice)
        reduction = reduction_for(choices.character, animation, shot.meshes, options, repeats=True)
        first = compile_shot(choices.character, animation, reduction.bodies(options.tolerance))
        converged = converged_reduction(first, reduction, options, retargeted=search)
        if search:
            result = optimize_to_tolerance(converged.shot, options, quiet, known=converged.known)
        else:
            result = simulate_to_tolerance(converged.shot, options, quiet, converged.error_m, converged.known)
        return result, sum(u.shape[1] for u in result.before.motion.elastic), more


def told(row: Kept) -> str:
    """One line of it."""
    return (
        f"{row.shot}, {1e3 * row.tolerance_m:g} mm: {1e3 * row.error_m:.2g} mm off, in {row.wall_s:.0f} s, "
        f"{row.run_s:.1f} s of them the {'search' if row.command == 'optimize' else 'simulation'}"
    )


HEADS = (
    "shot", "tolerance", "error", "estimate", "reference to", "step", "coordinates", "run", "in all", "shake before",
    "after",
)  # fmt: skip


def cells(rows: Sequence[Kept]) -> list[list[str]]:
    """The table for a person, without its heads."""
    from calmotion.cli import length

    return [
        [
            row.shot, length(row.tolerance_m), length(row.error_m), length(row.estimated_m), length(row.reference_m),
            f"{1e3 * row.step_s:.3g} ms", str(row.coordinates), f"{row.run_s:.2f} s", f"{row.wall_s:.1f} s",
            length(row.shake_before_m), length(row.shake_after_m) if row.command == "optimize" else "-",
        ]
        for row in rows
    ]  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 when a tolerance is not kept."""
    parser = bench_parser("tolerances", __doc__)
    shots_argument(parser, SAMPLES)
    parser.add_argument(
        "--tolerances", metavar="LENGTH", nargs="+", type=quantity("m", positive=True), default=list(TOLERANCES)
    )
    output_options(parser, csv="a table", markdown=True)
    parser.add_argument(
        "--nodes", type=float, default=TIMES, metavar="N",
        help=f"nodes of the reference's meshes over those of the shot's (default: {TIMES:g})",
    )  # fmt: skip
    parser.add_argument("--optimize", action="store_true", help="optimise the shots, which takes much longer")
    parser.add_argument("--resume", action="store_true", help="keep the rows that the file of --csv has")
    options = parser.parse_args(arguments)
    known: list[Kept] = resumed_rows(parser, options, Kept)
    rows: list[Kept] = []
    share = FINER_MESHED if options.nodes > 1.0 else FINER
    command = "optimize" if options.optimize else "simulate"
    for path in options.shots:
        shot = Tolerances(load_unreduced(path), share * min(options.tolerances), options.nodes)
        before = {row.tolerance_m: row for row in known if (row.shot, row.command) == (shot.shot.name, command)}
        if not before.keys() >= set(options.tolerances):
            shot.warm(max(options.tolerances), command)
        for tolerance in options.tolerances:
            rows.append(before.get(tolerance) or shot.kept(tolerance, command))
            say(told(rows[-1]))  # the next may take long
            if options.csv:
                write_rows(options.csv, Kept, [*rows, *(row for row in known if row not in rows)])
    title = {"simulate": "Simulated", "optimize": "Optimised"}[command]
    found = {"machine": machine(), "rows": [asdict(row) | {"kept": row.kept} for row in rows]}
    finish(options, f"{title} to a tolerance, against a far finer simulation", HEADS, cells(rows), found)
    return int(not all(row.kept for row in rows))
