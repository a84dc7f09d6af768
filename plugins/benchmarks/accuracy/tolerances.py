"""Measured errors of shots that are simulated or optimised with `--tolerance`, against a finer simulation.

`calmotion bench tolerances [SHOT ...] [--csv FILE]` simulates each shot as animated with each tolerance, with the
choices of the program, and measures the result against a simulation without simplifications, with a much smaller step,
many more coordinates, and meshes of eight times the nodes. With `--optimize` it optimises each shot, and simulates the
optimised curves again. The error is the largest distance of any target, at any frame, between the two. Meshes and
reductions of references stay in the cache. The command fails where a tolerance is not kept.
"""

import time
from dataclasses import dataclass, replace

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

from ..common.reporting import bench_parser, cells_of, finish, keep, say
from ..common.shots import SAMPLES, Unreduced, load_unreduced
from ..common.timing import machine
from .reference_bench import FINEST, TIMES, Bench, Reference

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)
# tolerance of the reference's reduction over the tightest that is measured: its finer meshes are known far worse
FINER = 1e-1


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


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 when a tolerance is not kept."""
    parser = bench_parser("tolerances", __doc__, SAMPLES)
    parser.add_argument(
        "--tolerances",
        metavar="LENGTH",
        nargs="+",
        type=quantity("m", positive=True),
        default=list(TOLERANCES),
        help="tolerances to simulate with, each with a unit (default: "
        + ", ".join(f"{1e3 * t:g}mm" for t in TOLERANCES)
        + ")",
    )
    parser.add_argument("--optimize", action="store_true", help="optimise the shots, which takes much longer")
    options = parser.parse_args(arguments)
    rows: list[Kept] = []
    command = "optimize" if options.optimize else "simulate"
    for path in options.shots:
        shot = Tolerances(load_unreduced(path), FINER * min(options.tolerances))
        shot.warm(max(options.tolerances), command)
        for tolerance in options.tolerances:
            rows.append(shot.kept(tolerance, command))
            say(" ".join(cells_of(rows[-1])))
            keep(options, Kept, rows)
    title = "Optimised" if options.optimize else "Simulated"
    finish(options, f"{title} to a tolerance, against a far finer simulation", rows, machine=machine())
    return int(not all(row.kept for row in rows))
