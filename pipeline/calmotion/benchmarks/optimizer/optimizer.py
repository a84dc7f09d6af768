"""Gauss-Newton against a quasi-Newton method, and run times of gradients and products.

`calmotion bench optimizer [SHOT ...]` optimises each shot by Gauss-Newton and by L-BFGS (scipy) on the same exact
gradient, and reports the time until each is within 1% of the converged objective, in forward simulations of the
same shot in the same run. It then times one gradient and one Gauss-Newton product for 10 to 2000 unknowns.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np
from scipy.optimize import minimize as quasi_newton

from calmotion.benchmarks.common.parsers import shots_parser
from calmotion.benchmarks.common.shots import BenchShot, load
from calmotion.benchmarks.common.timing import median_time
from calmotion.retargeting.problem.offset_basis import OffsetBasis, make_basis
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.posing import CLOSENESS, SMOOTHNESS
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.solver.damping_homotopy import damping_homotopy
from calmotion.retargeting.solver.gauss_newton import Search, minimize
from calmotion.shot.character import Array
from calmotion.shot.run import RunSettings
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.intended_motion import rigid_motion
from calmotion.simulation.prepare import Prepared, lowest_frequency, prepare
from calmotion.simulation.target_errors import Objective

CLOSE = 1.01  # objectives within this factor of the converged one count as reached
GAIN = 1e-6  # of the reference solution [m]
UNIT = 0.01  # of the unknowns of L-BFGS, whose first step is of length one [rad]
FAILED = 1e6  # objective of what cannot be simulated, over that of the input


@dataclass(frozen=True)
class Convergence:
    """One method on one shot.

    Attributes:
        shot, method: Names.
        forward_s: One forward simulation [s].
        objective, converged: Objective reached, and that of the reference solution.
        largest_before_mm, largest_after_mm: Largest error at any target [mm].
        evaluations, products: Forward simulations, and linearised products.
        seconds: Until the objective came within 1% of the converged one; None where it never did.
        simulations: The same in forward simulations.
    """

    shot: str
    method: str
    forward_s: float
    objective: float
    converged: float
    largest_before_mm: float
    largest_after_mm: float
    evaluations: int
    products: int
    seconds: float | None
    simulations: float | None


@dataclass(frozen=True)
class Cost:
    """Time of one gradient and of one product over that of one forward simulation, for a number of unknowns."""

    shot: str
    unknowns: int
    forward_s: float
    gradient: float
    product: float


def make_problem(shot: BenchShot, prepared: Prepared, spacing: float) -> RetargetProblem:
    """The problem without limits, knots `spacing` [s] apart."""
    model, grid, world = prepared.model, prepared.grid, prepared.world
    curves = sample_curves(shot.animation.tracks, grid)
    meant = rigid_motion(model, curves.angles, curves.rates, grid.h, world, grid.cyclic)
    objective = Objective.over(model, meant, grid, shot.animation.weights)
    basis: OffsetBasis = make_basis(grid, spacing, False)
    motors = np.array([k for k, motor in enumerate(shot.character.motors) if motor.optimize], dtype=np.int32)
    space = OffsetSpace.uncoupled(basis, motors, len(shot.character.motors), SMOOTHNESS, CLOSENESS)
    return RetargetProblem(model, grid, curves, objective, space, world)


def _largest(problem: RetargetProblem) -> float:
    errors = problem.run.target_positions - problem.objective.intended.target_positions
    return 1e3 * float(np.linalg.norm(errors, axis=2)[problem.grid.judged].max())


def _reference(shot: BenchShot, prepared: Prepared, zero: Array) -> Search:
    """A solution that is converged further than those that are compared."""
    problem, free = make_problem(shot, prepared, 0.05), np.zeros(len(zero), bool)
    problem.value(zero)
    start = damping_homotopy(problem, zero, free, lowest_frequency(prepared))
    return minimize(problem, start, free, GAIN, 60, 200)


def compare(shot: BenchShot, lbfgs: int) -> list[Convergence]:
    """Both methods on one shot.

    Args:
        lbfgs: Most evaluations of L-BFGS.
    """
    prepared = prepare(shot.compiled, RunSettings())
    problem = make_problem(shot, prepared, 0.05)
    zero, free = np.zeros(problem.size), np.zeros(problem.size, bool)
    forward = median_time(lambda: problem.value(zero))
    problem.linearize()
    problem.product(np.ones(problem.size))
    problem.value(zero)
    before = _largest(problem)
    reference = _reference(shot, prepared, zero)
    converged = problem.value(reference.x)

    def row(method: str, trace: list[tuple[float, float]], x: Array, evaluations: int, products: int) -> Convergence:
        reached = next((seconds for seconds, value in trace if value <= CLOSE * converged), None)
        objective = problem.value(x)
        return Convergence(
            shot.name, method, forward, objective, converged, before, _largest(problem), evaluations, products,
            reached, None if reached is None else reached / forward,
        )  # fmt: skip

    trace: list[tuple[float, float]] = []
    fresh = make_problem(shot, prepared, 0.05)
    begin = time.perf_counter()

    def on_iterate(search: Search) -> None:
        trace.append((time.perf_counter() - begin, fresh.merit()))

    fresh.value(zero)
    start = damping_homotopy(fresh, zero, free, lowest_frequency(prepared))
    found = minimize(fresh, start, free, 5e-6, on_iterate=on_iterate)
    rows = [row("Gauss-Newton", trace, found.x, found.evaluations, found.products)]

    class Enough(Exception):
        pass

    best: list[tuple[float, float]] = []
    other, at = make_problem(shot, prepared, 0.05), [zero]
    begin = time.perf_counter()

    initial = problem.value(zero)

    def both(y: Array) -> tuple[float, Array]:
        x = UNIT * y
        value = other.value(x)
        gradient = other.linearize() if np.isfinite(value) else np.zeros_like(x)
        if not best or value < min(item[1] for item in best):
            at[0] = x.copy()
        best.append((time.perf_counter() - begin, value))
        if len(best) >= lbfgs or value <= CLOSE * converged:
            raise Enough
        return min(value, FAILED * initial) / initial, UNIT * gradient / initial

    try:
        quasi_newton(
            both, zero, jac=True, method="L-BFGS-B", options={"maxiter": lbfgs, "maxcor": 20, "ftol": 0.0, "gtol": 0.0}
        )
    except Enough:
        pass
    rows.append(row("L-BFGS", best, at[0], len(best), 0))
    if rows[1].seconds is None:
        # the time it was given, as a bound from below
        rows.append(row("L-BFGS, time spent", [(best[-1][0], 0.0)], at[0], len(best), 0))
    return rows


def costs(shot: BenchShot) -> list[Cost]:
    """Gradient and product for 10 to 2000 unknowns: knots closer and closer, on the same simulation."""
    prepared = prepare(shot.compiled, RunSettings())
    end, motors = float(prepared.grid.frame_times[-1]), len(shot.character.motors)
    rows: list[Cost] = []
    # every instant may carry a knot here, so that there can be more unknowns than frames times motors
    grid = prepared.grid
    prepared = replace(prepared, grid=replace(grid, frame_times=grid.times[grid.pre_steps :], substeps=1))
    for wanted in (10, 50, 200, 2000):
        problem = make_problem(shot, prepared, end * motors / wanted)
        if rows and problem.size == rows[-1].unknowns:
            continue
        zero = np.zeros(problem.size)
        forward = median_time(partial(problem.value, zero))
        gradient = median_time(problem.linearize)
        product = median_time(partial(problem.product, np.random.default_rng(0).normal(size=problem.size)))
        rows.append(Cost(shot.name, problem.size, forward, gradient / forward, product / forward))
    return rows


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = shots_parser("optimizer", __doc__)
    parser.add_argument("--lbfgs", type=int, default=400, help="most evaluations of L-BFGS")
    options = parser.parse_args(arguments)
    converged: list[Convergence] = []
    timed: list[Cost] = []
    for name in options.shots:
        shot = load(name)
        timed += costs(shot)
        converged += compare(shot, options.lbfgs)
        if not options.json:
            print_tables(converged[-3:], timed[-4:], shot.name)
    if options.json:
        print(json.dumps({"convergence": [asdict(r) for r in converged], "costs": [asdict(r) for r in timed]}))
    return 0


def print_tables(converged: list[Convergence], timed: list[Cost], name: str) -> None:
    """The tables of one shot for a person."""
    from calmotion.cli.tables import console_on, print_table

    console = console_on(sys.stdout)
    rows = [
        [
            row.method, f"{row.largest_before_mm:.1f} -> {row.largest_after_mm:.2f} mm",
            f"{row.objective / row.converged:.4g}", str(row.evaluations), str(row.products),
            "-" if row.simulations is None else f"{row.simulations:.1f}",
        ]
        for row in converged if row.shot == name
    ]  # fmt: skip
    heads = ["method", "largest error", "objective / converged", "simulations", "products", "cost to 1% [simulations]"]
    print_table(console, f"{name}: convergence", heads, rows)
    if not timed:
        return
    rows = [
        [str(row.unknowns), f"{row.forward_s:.3f} s", f"{row.gradient:.2f}", f"{row.product:.2f}"]
        for row in timed
        if row.shot == name
    ]
    heads = ["unknowns", "simulation", "gradient / simulation", "product / simulation"]
    print_table(console, f"{name}: cost", heads, rows, texts=0)


if __name__ == "__main__":
    sys.exit(main())
