"""Gauss-Newton against a quasi-Newton method.

`calmotion bench optimizer [SHOT ...]` optimises each shot by Gauss-Newton and by L-BFGS (scipy) on the same exact
gradient, and reports the time until each is within 1% of the converged objective, in forward simulations of the
same shot in the same run.
"""

import time
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from calmotion.model import RunSettings
from calmotion.retargeting import (
    CLOSENESS,
    SMOOTHNESS,
    Ends,
    Evaluation,
    OffsetBasis,
    OffsetSpace,
    RetargetProblem,
    Search,
    damping_homotopy,
    make_basis,
    minimize,
)
from calmotion.simulation import (
    CompiledShot,
    Objective,
    Prepared,
    lowest_frequency,
    prepare,
    rigid_motion,
    sample_curves,
)
from scipy.optimize import minimize as quasi_newton

from ..common.reporting import bench_parser, on_shots
from ..common.shots import SAMPLES
from ..common.timing import median_time

CLOSE = 1.01  # objectives within this factor of the converged one count as reached
GAIN = 1e-6  # of the reference solution [m]
SPACING = 0.05  # of the knots [s]
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


def make_problem(shot: CompiledShot, prepared: Prepared, spacing: float) -> RetargetProblem:
    """The problem without limits, knots `spacing` [s] apart."""
    model, grid, world = prepared.model, prepared.grid, prepared.world
    curves = sample_curves(shot.animation.tracks, grid)
    meant = rigid_motion(model, curves.angles, curves.rates, grid.h, world, grid.cyclic)
    objective = Objective.over(model, meant, grid, shot.animation.weights)
    basis: OffsetBasis = make_basis(grid, spacing, False)
    motors = np.array([k for k, motor in enumerate(shot.character.motors) if motor.optimize], dtype=np.int32)
    space = OffsetSpace.uncoupled(basis, motors, len(shot.character.motors), SMOOTHNESS, CLOSENESS)
    return RetargetProblem.of_model(model, grid, curves, objective, space, world)


def compare(name: str, shot: CompiledShot, lbfgs: int) -> list[Convergence]:
    """Both methods on one shot, against a solution that is converged further.

    Args:
        name: Of the shot.
        shot: The shot.
        lbfgs: Most evaluations of L-BFGS.
    """
    prepared = prepare(shot, RunSettings())
    problem = make_problem(shot, prepared, SPACING)
    zero = np.zeros(problem.size)
    forward = median_time(lambda: problem.at(zero))
    start = problem.at(zero)
    start.linearized().product(np.ones(problem.size))  # compiles
    before = _largest(start)
    reference, _ = _gauss_newton(make_problem(shot, prepared, SPACING), prepared, GAIN, 60, 200)
    converged = problem.at(reference.x).merit

    def row(method: str, trace: list[tuple[float, float]], x: Array, evaluations: int, products: int) -> Convergence:
        reached = next((seconds for seconds, value in trace if value <= CLOSE * converged), None)
        at = problem.at(x)
        objective = at.merit
        return Convergence(
            shot=name,
            method=method,
            forward_s=forward,
            objective=objective,
            converged=converged,
            largest_before_mm=before,
            largest_after_mm=_largest(at),
            evaluations=evaluations,
            products=products,
            seconds=reached,
            simulations=None if reached is None else reached / forward,
        )

    found, trace = _gauss_newton(make_problem(shot, prepared, SPACING), prepared, 5e-6)
    rows = [row("Gauss-Newton", trace, found.x, found.evaluations, found.products)]
    best, trace = _lbfgs(make_problem(shot, prepared, SPACING), lbfgs, CLOSE * converged)
    rows.append(row("L-BFGS", trace, best, len(trace), 0))
    return rows


def _largest(at: Evaluation) -> float:
    """Largest error at any target [mm]."""
    errors = at.run.target_positions - at.problem.objective.intended.target_positions
    return 1e3 * float(np.linalg.norm(errors, axis=2)[at.problem.grid.judged].max())


def _gauss_newton(
    problem: RetargetProblem, prepared: Prepared, gain: float, iterations: int = 30, products: int = 60
) -> tuple[Search, list[tuple[float, float]]]:
    """The search from the animation, and the time [s] and objective of each iterate.

    Args:
        gain: That ends it [m].
        iterations, products: At most, the latter in each iteration.
    """
    zero, free = np.zeros(problem.size), np.zeros(problem.size, bool)
    trace: list[tuple[float, float]] = []
    begin = time.perf_counter()

    def on_iterate(search: Search) -> None:
        trace.append((time.perf_counter() - begin, search.at.merit))

    start = damping_homotopy(problem.at(zero), free, lowest_frequency(prepared))
    return minimize(problem, start, free, Ends(gain, iterations, products), on_iterate), trace


class _Enough(Exception):
    """The quasi-Newton method has come as far, or taken as long, as it should."""


def _lbfgs(problem: RetargetProblem, most: int, enough: float) -> tuple[Array, list[tuple[float, float]]]:
    """The best unknowns, and the time [s] and objective of each evaluation.

    Args:
        most: Evaluations.
        enough: Objective that ends it.
    """
    best = np.zeros(problem.size)
    trace: list[tuple[float, float]] = []
    initial = problem.at(best).merit
    begin = time.perf_counter()

    def both(y: Array) -> tuple[float, Array]:
        x = UNIT * y
        at = problem.tried(x)
        value = np.inf if at is None else at.merit
        gradient = np.zeros_like(x) if at is None else at.linearized().gradient
        if not trace or value < min(item[1] for item in trace):
            best[:] = x
        trace.append((time.perf_counter() - begin, value))
        if len(trace) >= most or value <= enough:
            raise _Enough
        return min(value, FAILED * initial) / initial, UNIT * gradient / initial

    options = {"maxiter": most, "maxcor": 20, "ftol": 0.0, "gtol": 0.0}
    with suppress(_Enough):
        quasi_newton(both, np.zeros(problem.size), jac=True, method="L-BFGS-B", options=options)
    return best, trace


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("optimizer", __doc__, SAMPLES[:1])
    parser.add_argument("--lbfgs", type=int, default=400, help="most evaluations of L-BFGS")
    options = parser.parse_args(arguments)
    return on_shots(options, "Convergence", Convergence, lambda name, shot: compare(name, shot, options.lbfgs))
