"""Input shapers and a low-pass filter in comparison with the optimised curves.

`calmotion bench baselines [SHOT ...]` simulates each shot as animated, through ZV and ZVD shapers for its lowest mode
and for its lowest two, through a low-pass filter, and optimised. Errors are those of the worst target against the
animation and, since shapers delay the motion, against the animation with the delay that is best for each method.
"""

from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from calmotion.model import SHAPERS, RunSettings
from calmotion.retargeting import Ends, RetargetProblem, damping_homotopy, minimize
from calmotion.simulation import CompiledShot, Curves, Simulator, best_delay, delay, modes_of, prepare, shaped

from ..common.reporting import bench_parser, on_shots
from ..common.shots import SAMPLES
from .optimizer import make_problem


@dataclass(frozen=True)
class Row:
    """One method on one shot.

    Attributes:
        shot, method: Names.
        delay_s: Mean delay of its impulses [s].
        largest_mm, rms_mm: Error of the worst target against the animation as timed [mm].
        best_delay_s, delayed_largest_mm: The delay of the animation that suits it best, and the error against that.
        change_deg: Largest change of a motor's curve [deg], of length motors [mm].
    """

    shot: str
    method: str
    delay_s: float
    largest_mm: float
    rms_mm: float
    best_delay_s: float
    delayed_largest_mm: float
    change_deg: float


def compare(name: str, shot: CompiledShot) -> list[Row]:
    """All methods on one shot."""
    prepared = prepare(shot, RunSettings())
    problem = make_problem(shot, prepared, 0.05)
    frequencies, damping = modes_of(prepared)
    simulator = Simulator(prepared.model, prepared.grid.h, prepared.world, prepared.grid.cyclic)
    rows = []
    for kind in ("as animated", *SHAPERS):
        curves, late = problem.curves, 0.0
        if kind in SHAPERS:
            curves = shaped(problem.curves, prepared.grid, kind, frequencies, damping)
            late = delay(kind, frequencies, damping)
        run = simulator.run(curves.angles, curves.rates)
        rows.append(_row(name, kind.replace("2", ", two modes"), late, problem, curves, run.target_positions))
    zero, free = np.zeros(problem.size), np.zeros(problem.size, bool)
    start = damping_homotopy(problem.at(zero), free, float(frequencies[0]))
    found = minimize(problem, start, free, Ends(5e-6)).at
    rows.append(_row(name, "optimised", 0.0, problem, found.curves, found.run.target_positions))
    return rows


def _row(shot: str, method: str, late: float, problem: RetargetProblem, curves: Curves, positions: Array) -> Row:
    grid, intended = problem.grid, problem.objective.intended.target_positions
    judged = np.flatnonzero(grid.judged)
    now = np.linalg.norm(positions[judged] - intended[judged], axis=2)
    best, delayed = best_delay(positions, intended, grid.judged, grid.h)
    change = np.abs(curves.angles - problem.curves.angles)[judged].max()
    return Row(
        shot=shot,
        method=method,
        delay_s=late,
        largest_mm=1e3 * float(now.max()),
        rms_mm=1e3 * float(np.sqrt(np.mean(now**2, axis=0)).max()),
        best_delay_s=best,
        delayed_largest_mm=1e3 * float(delayed.max()),
        change_deg=float(np.degrees(change)),
    )


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    options = bench_parser("baselines", __doc__, SAMPLES).parse_args(arguments)
    return on_shots(options, "Shapers, a filter and optimised curves", Row, compare)
