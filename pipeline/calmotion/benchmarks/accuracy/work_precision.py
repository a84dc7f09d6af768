"""Error against run time: every choice of the simulation, measured against a reference that is itself measured.

`calmotion bench work-precision [SHOT ...] [--csv FILE] [--figures DIR]` simulates each shot as animated by many
settings: step and integrator, reduction, directions that bodies are held to, elastic law, elements, and what
`--tolerance` chooses. The error is the largest distance of any target, at any frame, to a reference with a far smaller
step and far more coordinates; how far that is from its own limit is its error bar, below which nothing is told apart.
Times are medians of the simulation. Each choice of a tolerance is compared with the fastest setting of all that keeps
it.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from calmotion.accuracy.pod_subspace import ProjectedBodies, ReferenceRun
from calmotion.accuracy.step_error import StepRun, distance, simulate_at
from calmotion.benchmarks.accuracy.pareto import over_fastest, print_over_fastest
from calmotion.benchmarks.common.shots import Unreduced, load_unreduced
from calmotion.benchmarks.common.tables import write_rows
from calmotion.benchmarks.common.timing import median_time
from calmotion.errors import ShotError
from calmotion.multibody.model.topology import span_tree
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.shot.character import Array, with_settings
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.inputs.time_grid import MAX_STEP
from calmotion.simulation.prepare import Options, load_envelopes

if TYPE_CHECKING:
    from calmotion.benchmarks.integrators.gradients import GradientError
    from calmotion.benchmarks.optimizer.optimizer import Convergence

SAMPLES = tuple(f"samples/{name}/{name}.usda" for name in ("bartender", "dancer", "rapper", "drummer", "boxer"))
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)
BASE, FINEST = 1e-5, 1e-7  # reductions: of the runs that vary something else, and of the reference [m]
REFERENCE_STEP, SMALLEST_STEP = 1 / 3840, 1 / 30720  # of the reference: at most, and where it ends
REPEATS = 3
ENOUGH_TIME = 10.0  # of runs that are timed [s]: longer ones are run once
LBFGS = 200  # most evaluations of the quasi-Newton method


@dataclass(frozen=True)
class Point:
    """One setting of one shot.

    Attributes:
        shot, series, setting: Names; series `default` and `tolerance` are what the program chooses.
        step_s: [s].
        coordinates: Elastic ones.
        wall_s: Median time of the simulation alone [s].
        error_m: Against the reference [m]; NaN where the simulation failed.
        why: The reason of a failure.
    """

    shot: str
    series: str
    setting: str
    step_s: float
    coordinates: int
    wall_s: float
    error_m: float
    why: str = ""


@dataclass(frozen=True)
class Reference:
    """Where the targets are at the frames [m], shape [f, K, 3], and how far that may be from its limit [m]."""

    positions: Array
    bar_m: float


class Bench:
    """One shot, its reductions kept."""

    def __init__(self, shot: Unreduced, repeats: int = REPEATS):
        self.shot, self.repeats = shot, repeats
        self.tree = span_tree(shot.character)
        self.loads = load_envelopes(shot.character, shot.animation, shot.meshes, Options())
        self._known: ReferenceRun | None = None

    def bodies(self, tolerance: float, **settings: Any) -> list[ReducedBody]:
        """The shot's bodies, reduced to a tolerance [m] with some of their `FlexibleSettings` changed."""
        character = with_settings(self.shot.character, lambda own: replace(own, **settings))
        return reduce_bodies(character, self.tree, self.shot.meshes, None, self.loads, tolerance)

    def run(self, bodies: Sequence[ReducedBody], step: float, integrator: str = "bdf2") -> StepRun:
        """One simulation of the shot as animated."""
        options = Options(integrator=integrator)
        return simulate_at(self.shot.character, self.shot.animation, bodies, options, step)

    def held(self, bodies: Sequence[ReducedBody], allowed: float) -> Sequence[ReducedBody]:
        """Bodies of the reduction `BASE` held to directions, which may change this much [m]."""
        shot = self.shot
        self._known = self._known or ReferenceRun(shot.animation, self.run(bodies, MAX_STEP))
        return ProjectedBodies(shot.character, bodies, Options(), lambda item: allowed, [self._known]).bodies or bodies

    def reference(self, finest: float = FINEST) -> Reference:
        """The finest run, its step extrapolated to zero, from steps as small as it takes.

        Its bar is what is left of the step's error, which falls by eight where that is halved, what ten times the
        tolerance of the reduction changes, what quadratic strain does not see, as estimated (what a reduction to ten
        times the tolerance would; to see more takes most of the time), and what holding its bodies to the directions
        that the shot needs does.

        Args:
            finest: Tolerance of the reduction [m].
        """
        shot, bodies = self.shot, self.bodies(finest, pairs_share=10.0)
        known = ReferenceRun(shot.animation, self.run(bodies, MAX_STEP))
        other = self.run(self.bodies(10.0 * finest), MAX_STEP)
        held = ProjectedBodies(shot.character, bodies, Options(), lambda item: finest, [known])
        limit, left = self._limit(held.bodies or bodies, 10.0 * finest)
        unseen = sum(body.elasticity.strain_error_m for body in bodies if body.elasticity is not None)
        reduced = distance(other.positions, known.run.positions) + unseen
        return Reference(limit, left + reduced + held.error_m)

    def _limit(self, bodies: Sequence[ReducedBody], allowed: float) -> tuple[Array, float]:
        """Positions of the targets as the step goes to zero [m], and what is left of its error there [m]."""
        step, left = 4.0 * REFERENCE_STEP, np.inf
        coarse = limit = self.run(bodies, step).positions
        while step > REFERENCE_STEP or (left > allowed and step > SMALLEST_STEP):
            step *= 0.5
            fine = self.run(bodies, step).positions
            last, limit = limit, fine + (fine - coarse) / 3.0
            coarse, left = fine, distance(limit, last) / 7.0
        return limit, left

    def measure(
        self, reference: Reference, series: str, setting: str, bodies: Sequence[ReducedBody], step: float,
        integrator: str = "bdf2",
    ) -> Point:  # fmt: skip
        """Error and time of one setting."""
        coordinates = sum(len(body.stiffness) for body in bodies)
        named = partial(Point, self.shot.name, series, setting, step, coordinates)
        begin = time.perf_counter()
        try:
            error = distance(self.run(bodies, step, integrator).positions, reference.positions)
        except ShotError as failed:
            return named(float("nan"), float("nan"), str(failed))
        took = time.perf_counter() - begin
        if took < ENOUGH_TIME:
            again = partial(self.run, bodies, step, integrator)
            took = median_time(again, self.repeats, warm=True, enough=ENOUGH_TIME)
        point = named(took, error)
        print(
            f"{point.shot}, {series}, {setting}: {1e3 * error:.2g} mm off in {took:.3g} s", file=sys.stderr, flush=True
        )
        return point


def machine() -> dict[str, object]:
    """What the times were measured on."""
    return {
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def print_points(points: Sequence[Point], bar: float) -> None:
    """The table of one shot for a person."""
    from calmotion.cli.tables import console_on, length, print_table

    rows = [
        [p.series, p.setting, f"1/{1 / p.step_s:.0f} s", str(p.coordinates), f"{p.wall_s:.3f} s", length(p.error_m)]
        for p in points
    ]
    title = f"{points[0].shot}: against a reference that is known to {length(bar)}"
    heads = ["choice", "setting", "step", "coordinates", "simulation", "error"]
    print_table(console_on(sys.stdout), title, heads, rows, texts=2)


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="calmotion bench work-precision", description=__doc__)
    parser.add_argument("shots", metavar="SHOT", nargs="*", default=list(SAMPLES), help="USD file (default: samples)")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout, and nothing else there")
    parser.add_argument("--csv", metavar="FILE", help="also write a table")
    parser.add_argument("--figures", metavar="DIR", help="also draw error against run time, to this folder")
    parser.add_argument("--elements", action="store_true", help="also vary the size of elements, which takes long")
    parser.add_argument(
        "--optimizer",
        action="store_true",
        help="also judge both adjoints by differences, and Gauss-Newton beside L-BFGS, which takes long",
    )
    parser.add_argument("--repeats", type=int, default=REPEATS, help="of which times are the median")
    options = parser.parse_args(arguments)
    from calmotion.benchmarks.accuracy.work_precision_points import chosen_points, element_points, forward_points

    points: list[Point] = []
    gradients: list[GradientError] = []
    converged: list[Convergence] = []
    bars: dict[str, float] = {}
    for name in options.shots:
        bench = Bench(load_unreduced(name), options.repeats)
        reference = bench.reference()
        own = forward_points(bench, reference) + chosen_points(bench, reference)
        own += element_points(bench) if options.elements else []
        bars[bench.shot.name] = reference.bar_m
        points += own
        if options.csv:
            write_rows(options.csv, Point, points)  # the next shot may take long
        if not options.json:
            print_points(own, reference.bar_m)
            print_over_fastest(own, TOLERANCES)
        if options.optimizer:
            from calmotion.benchmarks.common.shots import load
            from calmotion.benchmarks.integrators.gradients import errors, print_gradients
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
        found = {"machine": machine(), "reference_error_m": bars, "points": rows, "figures": figures}
        found["over_fastest"] = {
            shot: {
                t: ratio for t, (ratio, _) in over_fastest([p for p in points if p.shot == shot], TOLERANCES).items()
            }
            for shot in bars
        }
        if options.optimizer:
            found |= {"gradients": [asdict(r) for r in gradients], "optimizers": [asdict(r) for r in converged]}
        print(json.dumps(found))
    else:
        for figure in figures:
            print(f"wrote {figure}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
