"""Retarget a shot: motor curves under which the flexible robot does what the animator meant."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from calmotion.errors import ShotError
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.retargeting.checkpoint import Checkpoint, problem_key
from calmotion.retargeting.problem.adaptive_knots import carried, useful_knots, wanted_breaks
from calmotion.retargeting.problem.limit_costs import limit_costs
from calmotion.retargeting.problem.offset_basis import OffsetBasis, basis_on
from calmotion.retargeting.problem.posing import locked_coefficients, pose
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.simplification.idle_motors import idle_gain, idle_motors
from calmotion.retargeting.simplification.inactive_intervals import (
    first_change,
    inactive_intervals,
    left_out_on,
    with_gains,
)
from calmotion.retargeting.simplification.pruning import UNCHANGED, block_energies, worthless
from calmotion.retargeting.simplification.report_rows import FINER, PRUNED, search_rows
from calmotion.retargeting.solver.damping_homotopy import damping_homotopy
from calmotion.retargeting.solver.gauss_newton import Search, minimize
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.shot import Animation, Character, MotorCurve, OptimizerStep, Result
from calmotion.shot.character import Array, BoolArray
from calmotion.shot.model_choice import OFF
from calmotion.simulation.bodies import mode_tables, skins
from calmotion.simulation.forward import limited_values
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.intended_motion import IntendedMotion
from calmotion.simulation.motor_limits import Excess, excesses, motor_bounds
from calmotion.simulation.prepare import Options, Prepared, failure_error, lowest_frequency, prepare, refuse_half_turns
from calmotion.simulation.report import left_out_rows, limit_uses, performed_motion, reference_motion, simulation_of
from calmotion.simulation.simulate import Progress, intended_motion
from calmotion.simulation.simulator import compile_kernels

WORTH = 0.005  # of the tolerance: what an iteration must be expected to gain
MISSED = 0.01  # of the tolerance: what changes in ranges that were left out may gain together
FIRST_PENALTY = 1e3  # of limits, over the objective of the input for each second


def _curves(problem: RetargetProblem, motors: int, x: Array) -> tuple[tuple[MotorCurve, ...], Array]:
    """The curves of all motors, and the coefficients with negligible offsets set to exactly zero."""
    basis, grid = problem.basis, problem.grid
    coefficients = x.reshape(basis.count, len(problem.motors)).copy()
    coefficients[:, np.max(np.abs(basis.values @ coefficients), axis=0) <= UNCHANGED] = 0.0
    by_motor = coefficients @ problem.coupling.T
    offsets = np.abs(basis.values @ by_motor)
    changes, largest = np.any(offsets > 0.0, axis=0), np.max(offsets[grid.judged], axis=0)
    curves = []
    for motor in range(motors):
        values, own, changed = problem.curves.angles[grid.frames, motor], by_motor[:, motor], bool(changes[motor])
        if changed:
            values = values + basis.at_frames @ own
        knots = useful_knots(basis, own) if changed else basis.knots[[0, -1]]
        curves.append(MotorCurve(motor, changed, knots, values, float(largest[motor])))
    return tuple(curves), coefficients.ravel()


def _progress_of(search: Search) -> tuple[OptimizerStep, ...]:
    return tuple(OptimizerStep(i.value, i.gradient_norm, i.evaluations, 2 * i.products) for i in search.history)


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
    refuse_other_integrators(options)
    prepared = prepare(character, animation, bodies, options)
    model, grid = prepared.model, prepared.grid
    curves = sample_curves(animation.tracks, grid)
    refuse_half_turns(prepared, curves.angles)
    try:
        meant = intended_motion(prepared, curves.angles, curves.rates)
        posed = pose(prepared, animation, curves, meant, options)
        progress(0.0, "compiling kernels, once")
        compile_kernels(
            model, Workspace.for_system(model.system), curves.angles, curves.rates, grid.h, prepared.world
        )  # fmt: skip
        return _search(prepared, animation, posed, meant, options, progress, checkpoint)
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure


def refuse_other_integrators(options: Options) -> None:
    """Raise ShotError where a search is to be by another integrator than the one that is differentiated."""
    if options.scheme != "bdf2":
        raise ShotError(
            "derivatives are those of BDF2 alone",
            attribute="--integrator",
            found=options.scheme,
            remedy="Leave it out, or use it with `calmotion simulate`.",
        )


def _search(
    prepared: Prepared, animation: Animation, posed: tuple[RetargetProblem, Array, bool], meant: IntendedMotion,
    options: Options, progress: Progress, checkpoint: Path | None,
) -> Result:  # fmt: skip
    character, grid, model = prepared.character, prepared.grid, prepared.model
    problem, start, adaptive = posed

    def locked_on(basis: OffsetBasis) -> BoolArray:
        return locked_coefficients(animation, basis, problem.motors, grid.end)

    def fixed_on(basis: OffsetBasis) -> BoolArray:
        return locked_on(basis) | left_out_on(basis, quiet, len(problem.motors))

    def fix() -> BoolArray:
        problem.hold(first_change(grid, problem.basis, fixed_on))
        return fixed_on(problem.basis)

    tolerance = character.retarget.allowed(options.tolerance)
    begin = time.perf_counter()
    problem.hold(0)
    if not np.isfinite(problem.value(np.zeros(problem.size))):
        assert problem.failure is not None
        raise failure_error(prepared, problem.failure)
    before, before_value, used_before = problem.run, problem.objective_value(), _used(problem, character)
    if problem.limits is not None:
        problem.limits.rho = FIRST_PENALTY * max(before_value, problem.worth(1e-3 * tolerance)) / grid.end
    kept = Checkpoint(checkpoint, problem_key(problem, locked_on(problem.basis), (options, tolerance)))
    frequency = lowest_frequency(prepared, animation)
    quiet = inactive_intervals(problem, start, frequency, tolerance, options.ranges)
    resumed = kept.load(problem.limits)
    search, interrupted, idle = Search.start(np.where(fixed_on(problem.basis), 0.0, start)), False, None
    if resumed is not None:
        search, breaks = resumed
        problem = problem.on_basis(basis_on(grid, breaks, problem.basis.kept_ends), search.x)
        if np.any(search.x[left_out_on(problem.basis, quiet, len(problem.motors))]):
            quiet = ()  # it had gone on with them
    fixed = fix()

    def on_iterate(found: Search) -> None:
        nonlocal search
        search = found
        kept.save(search, problem.limits, problem.basis.breaks)
        done = min(0.9, 0.1 + 0.12 * len(search.history))
        progress(done, f"optimising: weighted error {1e3 * problem.error:.3f} mm, {search.evaluations} simulations")

    try:
        if resumed is None and not np.any(start):
            search = damping_homotopy(problem, start, fixed, frequency)
        while True:
            if not search.reason:
                search = minimize(
                    problem, search, fixed, WORTH * tolerance, options.max_iterations, on_iterate=on_iterate
                )
                kept.save(search, problem.limits, problem.basis.breaks)
            if search.reason == "iteration limit":
                break
            finer = _finer(problem, search, fixed_on, FINER * tolerance) if adaptive else None
            if finer is not None:
                problem, search = finer
            else:
                if quiet:
                    quiet, search = with_gains(problem, search, quiet, locked_on)
                if options.ranges == OFF or sum(item.gain for item in quiet) <= MISSED * tolerance:
                    break
                quiet, search = (), _afresh(search, search.x)
            fixed = fix()
        if len(idle_motors(character)):
            search, idle = _looked_at_idle(problem, search, character)
        fixed = fix()
        progress(0.9, "leaving out offsets that gain nothing")
        search = _pruned(problem, search, fixed, tolerance, options.max_iterations)
    except KeyboardInterrupt:
        interrupted = True
        progress(0.95, "interrupted: writing the best so far")
    curves, x = _curves(problem, len(character.motors), search.x)
    problem.forget()
    problem.value(x)
    run, after_value, used = problem.run, problem.objective_value(), _used(problem, character)
    costs = {} if interrupted else limit_costs(problem, fixed)
    wall = time.perf_counter() - begin
    rows = left_out_rows(prepared) + search_rows(problem, character, curves, quiet, options, idle)
    return Result(
        reference=reference_motion(model, grid, meant, problem.curves.angles),
        before=simulation_of(prepared, before, meant.reference),
        after=simulation_of(prepared, run, meant.reference),
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
        pre_roll_s=grid.pre_roll,
        dof=model.dof,
        left_out=tuple(rows),
        limits=limit_uses(used_before, used, grid, costs),
        stopped="interrupted" if interrupted else search.reason,
        expected_gain_m=_expected(search),
        interrupted=interrupted,
        performed=performed_motion(prepared, problem.changed_curves),
        idle_gain_m=idle,
    )


def _finer(
    problem: RetargetProblem, search: Search, fixed_on: Callable[[OffsetBasis], BoolArray], gain: float
) -> tuple[RetargetProblem, Search] | None:
    """The problem and its search on finer knots; None where these would gain too little."""
    if not problem.linearized_at(search.x):
        problem.value(search.x)
        problem.linearize()
        search = replace(search, evaluations=search.evaluations + 1, gradients=search.gradients + 1)
    breaks = wanted_breaks(problem, search.x, fixed_on, gain)
    if breaks is None:
        return None
    basis = basis_on(problem.grid, breaks, problem.basis.kept_ends)
    # what does not change stays exactly so
    x = np.where(fixed_on(basis), 0.0, carried(problem.basis, basis, search.x, len(problem.motors)))
    return problem.on_basis(basis, x), _afresh(search, x)


def _looked_at_idle(problem: RetargetProblem, search: Search, character: Character) -> tuple[Search, float | None]:
    """What idle motors promise where the search ended; they act at any time of the shot."""
    problem.hold(0)
    problem.value(search.x)
    problem.linearize()
    counted = replace(search, evaluations=search.evaluations + 1, gradients=search.gradients + 1)
    return counted, idle_gain(problem, character)


def _afresh(search: Search, x: Array) -> Search:
    """A search that goes on over other coefficients."""
    return replace(search, x=x, radius=np.inf, recycled=Recycled.none(len(x)), reason="")


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
    limits = problem.limits
    found = minimize(problem, begin, held, WORTH * tolerance, max_iterations=max_iterations + 3)
    after = problem.value(found.x)
    if after <= value + 2.0 * budget and (limits is None or limits.kept(problem.limited)):
        return replace(found, reason=search.reason)
    return replace(search, evaluations=found.evaluations, gradients=found.gradients, products=found.products)
