"""Retarget a shot: motor curves under which the flexible robot does what the animator meant."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..dynamics.failure import SimulationFailure
from ..dynamics.simulation import Workspace
from ..errors import ShotError
from ..fem.reduced_body import ReducedBody
from ..shot import Animation, Character, LeftOut, MotorCurve, OptimizerStep, Result
from ..shot.character import DEFAULT_TOLERANCE, Array, BoolArray, IntArray
from .approach import approach
from .bodies import mode_tables, skins
from .checkpoint import Checkpoint, problem_key
from .curves import Curves, sample_curves, sample_tracks
from .gauss_newton import Search, minimize
from .limit_costs import limit_costs
from .limits import Excess, LimitTerms, excesses, motor_bounds
from .objective import Objective
from .offset_basis import OffsetBasis, make_basis
from .prepare import Options, Prepared, failure_error, lowest_frequency, prepare, refuse_half_turns
from .problem import RetargetProblem, compile_kernels, limited_values
from .pruning import block_energies, worthless
from .reference import MeantMotion
from .report import left_out_rows, limit_uses, reference_motion, simulation_of
from .run import Progress, meant_motion
from .time_grid import TimeGrid

SMOOTHNESS = 1e-10
CLOSENESS = 1e-4  # an offset of 0.1 rad weighs as much as an error of 1 mm [m^2/rad^2]
UNCHANGED = 1e-5  # an offset that stays below this angle [rad] is none
KNOT_SPACING = 0.05
WORTH = 0.005  # of the tolerance: what an iteration must be expected to gain
PRUNED = 0.02  # of the tolerance: what offsets that are dropped may cost together
FIRST_PENALTY = 1e3  # of limits, over the objective of the input for each second


def _start(basis: OffsetBasis, animation: Animation, motors: IntArray, grid: TimeGrid) -> Array:
    """Coefficients of the offset that the shot already carries, zero when it carries none."""
    if animation.current is animation.tracks:
        return np.zeros(basis.count * len(motors))
    meant, _ = sample_tracks([animation.tracks[k] for k in motors], grid)
    current, _ = sample_tracks([animation.current[k] for k in motors], grid)
    coefficients, *_ = np.linalg.lstsq(basis.values.toarray(), current - meant, rcond=None)
    return coefficients.ravel()


def _curves(problem: RetargetProblem, motors: int, x: Array) -> tuple[tuple[MotorCurve, ...], Array]:
    """The curves of all motors, and the coefficients with negligible offsets set to exactly zero."""
    basis, grid = problem.basis, problem.grid
    coefficients = x.reshape(basis.count, len(problem.motors)).copy()
    offsets = basis.values @ coefficients
    column = {int(motor): k for k, motor in enumerate(problem.motors)}
    curves = []
    for motor in range(motors):
        input_at_frames = problem.curves.angles[grid.frames, motor]
        largest = float(np.max(np.abs(offsets[:, column[motor]]))) if motor in column else 0.0
        changed = largest > UNCHANGED
        values = input_at_frames
        if changed:
            values = input_at_frames + basis.at_frames @ coefficients[:, column[motor]]
        elif motor in column:
            coefficients[:, column[motor]] = 0.0
        curves.append(MotorCurve(motor, changed, basis.knots, values, largest if changed else 0.0))
    return tuple(curves), coefficients.ravel()


def _progress_of(search: Search) -> tuple[OptimizerStep, ...]:
    return tuple(OptimizerStep(i.value, i.gradient_norm, i.evaluations, 2 * i.products) for i in search.history)


def locked_coefficients(animation: Animation, basis: OffsetBasis, motors: IntArray, end: float) -> BoolArray:
    """Coefficients that would change a curve where the shot locks it, ordered by basis function, then motor.

    Args:
        end: Last frame of the shot [s].
    """
    fixed = np.zeros((basis.count, len(motors)), bool)
    first, last = basis.support.T
    column = {int(motor): k for k, motor in enumerate(motors)}
    for track in animation.free:
        if track.motor in column:
            for start, stop in track.locked(end):
                # functions of a loop that begin before it also act at its end
                for late in (0.0, end) if basis.wraps else (0.0,):
                    fixed[(first + late < stop) & (last + late > start), column[track.motor]] = True
    return fixed.ravel()


def optimize_shot(
    character: Character,
    animation: Animation,
    bodies: Sequence[ReducedBody] | None,
    options: Options,
    progress: Progress,
    checkpoint: Path | None = None,
) -> Result:
    """Retarget a shot: change its motor curves so that the flexible robot moves as it was animated to.

    An interrupt (Ctrl-C) ends the search; the best curves so far are then the result.

    Args:
        checkpoint: File in which the search is kept after each iteration, and from which it goes on when it is there;
            None keeps nothing.

    Raises:
        ShotError: The shot cannot be processed.
    """
    if options.integrator != "bdf2":
        raise ShotError(
            "derivatives are those of BDF2 alone",
            attribute="--integrator",
            found=options.integrator,
            remedy="Leave it out, or use it with `calmotion simulate`.",
        )
    prepared = prepare(character, animation, bodies, options)
    model, grid = prepared.model, prepared.grid
    curves = sample_curves(animation.tracks, grid)
    refuse_half_turns(prepared, curves.angles)
    try:
        meant = meant_motion(prepared, curves.angles, curves.rates)
        problem, fixed = _problem(prepared, animation, curves, meant, options)
        progress(0.0, "compiling kernels, once")
        compile_kernels(
            model, Workspace.for_system(model.system), curves.angles, curves.rates, grid.h, prepared.world
        )  # fmt: skip
        return _search(prepared, animation, problem, fixed, meant, options, progress, checkpoint)
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure


def _problem(
    prepared: Prepared, animation: Animation, curves: Curves, meant: MeantMotion, options: Options
) -> tuple[RetargetProblem, BoolArray]:
    """The problem, and which of its unknowns stay as they are."""
    character, grid, settings = prepared.character, prepared.grid, prepared.character.retarget
    spacing = options.knot_spacing or settings.knot_spacing or KNOT_SPACING
    smoothness = next(v for v in (options.smoothness, settings.smoothness, SMOOTHNESS) if v is not None)
    basis = make_basis(grid, spacing, settings.endpoints == "kept")
    movable = np.array([motor.optimize for motor in character.motors], bool)
    motors = np.flatnonzero(movable).astype(np.int32)
    if not basis.count:
        raise ShotError(
            "the shot is too short to change anything between its kept end poses",
            path=character.path,
            attribute="calm:retarget:endpoints",
            found=settings.endpoints,
            remedy="Set it to free, or lengthen the shot to five frames or more.",
        )
    fixed = locked_coefficients(animation, basis, motors, float(grid.frame_times[-1]))
    if not len(motors) or np.all(fixed):
        raise ShotError(
            "every motor is locked, so there is nothing to optimise",
            path=character.path,
            attribute="calm:motor:optimize",
            remedy="Set it to true on the motors that may change.",
        )
    objective = Objective.over(prepared.model, meant.reference, grid, animation.weights)
    bounds = motor_bounds(character, movable)
    limits = LimitTerms(bounds, grid.judged, grid.h, 1.0) if bounds else None
    continuous = options.adjoint == "continuous"
    if continuous and ("effort" in bounds or grid.cyclic):
        raise ShotError(
            f"the continuous adjoint {'plays a shot once' if grid.cyclic else 'cannot keep limits of effort'}",
            path=character.path,
            attribute="retarget.optimize.adjoint",
            found=options.adjoint,
            remedy="Use the discrete one.",
        )
    problem = RetargetProblem(
        prepared.model, grid, curves, objective, basis, motors, smoothness, CLOSENESS, prepared.world, limits,
        continuous,
    )  # fmt: skip
    return problem, fixed


def _search(
    prepared: Prepared, animation: Animation, problem: RetargetProblem, fixed: BoolArray, meant: MeantMotion,
    options: Options, progress: Progress, checkpoint: Path | None,
) -> Result:  # fmt: skip
    character, grid, model = prepared.character, prepared.grid, prepared.model
    tolerance = options.tolerance or character.retarget.tolerance or DEFAULT_TOLERANCE
    begin = time.perf_counter()
    if not np.isfinite(problem.value(np.zeros(problem.size))):
        assert problem.failure is not None
        raise failure_error(prepared, problem.failure)
    before, before_value, used_before = problem.run, problem.objective_value(), _used(problem, character)
    if problem.limits is not None:
        seconds = float(grid.frame_times[-1])
        problem.limits.rho = FIRST_PENALTY * max(before_value, problem.worth(1e-3 * tolerance)) / seconds
    kept = Checkpoint(checkpoint, problem_key(problem, fixed, (options, tolerance)))
    start = np.where(fixed, 0.0, _start(problem.basis, animation, problem.motors, grid))
    resumed = kept.load(problem.limits)
    search = resumed or Search.start(start)
    interrupted = False

    def on_iterate(found: Search) -> None:
        nonlocal search
        search = found
        kept.save(search, problem.limits)
        done = min(0.9, 0.1 + 0.12 * len(search.history))
        progress(done, f"optimising: weighted error {1e3 * problem.error:.3f} mm, {search.evaluations} simulations")

    try:
        if resumed is None and not np.any(start):
            search = approach(problem, start, fixed, lowest_frequency(prepared, animation))
        if not search.reason:
            search = minimize(
                problem, search, fixed, WORTH * tolerance, max_iterations=options.max_iterations, on_iterate=on_iterate
            )
            kept.save(search, problem.limits)
        progress(0.9, "leaving out offsets that gain nothing")
        search = _pruned(problem, search, fixed, tolerance, options.max_iterations)
    except KeyboardInterrupt:
        interrupted = True
        progress(0.95, "interrupted: writing the best so far")
    curves, x = _curves(problem, len(character.motors), search.x)
    problem.value(x)
    run, after_value, used, growth = problem.run, problem.objective_value(), _used(problem, character), problem.growth
    costs = {} if interrupted else limit_costs(problem, fixed)
    wall = time.perf_counter() - begin
    rows = left_out_rows(prepared)
    rows += [
        LeftOut("changes of " + character.motors[curve.motor].path, "they would gain less than 2% of the tolerance")
        for curve in curves
        if not curve.changed and character.motors[curve.motor].optimize
    ]
    return Result(
        reference=reference_motion(model, grid, meant, problem.curves.angles),
        before=simulation_of(model, grid, before, meant.reference, len(character.motors)),
        after=simulation_of(model, grid, run, meant.reference, len(character.motors), growth),
        skins=skins(prepared.bodies),
        modes=mode_tables(prepared.bodies),
        curves=curves,
        steps=_progress_of(search),
        objective_before=before_value,
        objective_after=after_value,
        gradients=search.gradients,
        linearized_sweeps=2 * search.products + search.gradients,
        forward_simulations=search.evaluations + 2,
        iterations=len(search.history),
        parameters=problem.size,
        wall_s=wall,
        step_s=grid.h,
        pre_roll_s=0.0 if grid.cyclic else grid.pre_roll,
        dof=model.dof,
        left_out=tuple(rows),
        limits=limit_uses(used_before, used, grid, costs),
        stopped="interrupted" if interrupted else search.reason,
        expected_gain_m=_expected(search),
        interrupted=interrupted,
    )


def _expected(search: Search) -> float | None:
    """The gain that one more iteration was expected to bring [m]; None where that was not worked out."""
    gain = search.history[-1].gain if search.history else np.nan
    return gain if np.isfinite(gain) else None


def _used(problem: RetargetProblem, character: Character) -> list[Excess]:
    """How far all motors go within all their limits, at the point evaluated last."""
    bounds = motor_bounds(character)
    values = limited_values(problem.model, bounds, problem.changed_curves, problem.run)
    return excesses(bounds, values, problem.grid.judged)


def _pruned(
    problem: RetargetProblem, search: Search, fixed: BoolArray, tolerance: float, max_iterations: int
) -> Search:
    """The search with offsets that gain next to nothing at zero; as it was where that costs too much."""
    value = problem.value(search.x)
    problem.linearize()
    budget = problem.worth(PRUNED * tolerance)
    energy = block_energies(search.x, len(problem.motors), problem.product(search.x))
    dropped = worthless(search.x, len(problem.motors), energy, budget) & ~fixed
    if not np.any(search.x[dropped]):
        return search
    held = fixed | dropped
    begin = replace(search, x=np.where(held, 0.0, search.x), reason="", radius=np.inf)
    limits, found = problem.limits, begin
    found = minimize(problem, begin, held, WORTH * tolerance, max_iterations=max_iterations + 3)
    after = problem.value(found.x)
    if after <= value + 2.0 * budget and (limits is None or limits.kept(problem.limited)):
        return replace(found, reason=search.reason)
    return replace(search, evaluations=found.evaluations, gradients=found.gradients, products=found.products)
