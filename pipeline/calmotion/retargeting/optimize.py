"""Retarget a shot: motor curves under which the flexible robot performs the intended motion."""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Character, Result
from calmotion.model.limits.bounds import Excess, excesses, motor_bounds
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import goal_of, tolerance_of
from calmotion.model.uncertainty import Scenario
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.retargeting.checkpoint import Checkpoint, problem_key
from calmotion.retargeting.found_curves import found_curves
from calmotion.retargeting.left_out import search_rows
from calmotion.retargeting.problem.limit_costs import limit_costs
from calmotion.retargeting.problem.posing import locked_coefficients, pose
from calmotion.retargeting.problem.problem import Evaluation, RetargetProblem, with_first_penalty
from calmotion.retargeting.quantities.kept_feet import with_kept_feet
from calmotion.retargeting.robust.robots import robots_of
from calmotion.retargeting.search import RetargetSearch
from calmotion.retargeting.search_progress import SearchMemory
from calmotion.retargeting.search_terms import refuse_terms, term_uses, with_terms
from calmotion.retargeting.solver.gauss_newton import Search
from calmotion.simulation.bodies import mode_tables, skins
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.forward import limited_values
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.inputs.open_chains import refuse_open_joints
from calmotion.simulation.inputs.supported import refuse_half_turns
from calmotion.simulation.preparation import Prepared, failure_error, lowest_frequency, prepare
from calmotion.simulation.report import left_out_rows, limit_uses, performed_motion, reference_motion, simulation_of
from calmotion.simulation.simulate import Progress, intended_motion
from calmotion.simulation.simulator import compile_kernels
from calmotion.simulation.target_errors import IntendedMotion
from calmotion.tolerance.reduced_bodies import DIRECTIONS, RunMemory


def optimize_shot(
    shot: CompiledShot, options: RunSettings, progress: Progress, checkpoint: Path | None = None,
    scenarios: Sequence[Scenario] = (), memory: RunMemory | None = None,
) -> Result:  # fmt: skip
    """Retarget a shot: change its motor curves so that the flexible robot moves as it was animated to.

    An interrupt (Ctrl-C) ends the search; the result then has the best curves so far.

    Args:
        checkpoint: File that stores the best point after each iteration, and from which a search resumes if the file
            exists; None stores nothing.
        scenarios: Robots for all of which the curves are optimised, the nominal one first; none: that one alone.
        memory: With what the last search left, and where this one leaves the same.

    Raises:
        ShotError: The shot cannot be processed.
    """
    refuse_other_integrators(options)
    refuse_terms(options, shot.character)
    prepared = prepare(shot, options)
    model, grid = prepared.model, prepared.grid
    curves = sample_curves(shot.animation.tracks, grid)
    refuse_half_turns(prepared.character, grid, curves.angles)
    try:
        intended = intended_motion(prepared, curves.angles, curves.rates)
        problem, start, adaptive = pose(prepared, curves, intended, options)
        if scenarios:
            problem = problem.for_robots(robots_of(prepared, problem, scenarios, options))
        progress(0.0, "loading kernels (compiled in the first run)")
        compile_kernels(model, Workspace.for_system(model.system), curves.angles, curves.rates, grid.h, prepared.world)
        return _optimized(prepared, (problem, start, adaptive), intended, options, progress, checkpoint, memory)
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure


def refuse_other_integrators(options: RunSettings) -> None:
    """Raise ShotError for integrators other than BDF2, the only one with derivatives."""
    if options.scheme != "bdf2":
        raise ShotError(
            "optimize supports only bdf2",
            attribute="--integrator",
            found=options.scheme,
            remedy="Remove the option, or use it with `calmotion simulate`.",
        )


def _optimized(
    prepared: Prepared, posed: tuple[RetargetProblem, Array, bool], intended: IntendedMotion, options: RunSettings,
    progress: Progress, checkpoint: Path | None, memory: RunMemory | None,
) -> Result:  # fmt: skip
    """Simulate the input, search, simulate the result."""
    character, animation, begin = prepared.character, prepared.shot.animation, time.perf_counter()
    problem, start, adaptive = posed
    tolerance = tolerance_of(character, options.tolerance)
    at = problem.at(np.zeros(problem.size))
    refuse_open_joints(character, prepared.model, prepared.grid, at.run, options)
    at = with_terms(with_kept_feet(prepared, at), character, options.terms)
    at = before = with_first_penalty(at, tolerance)
    problem = at.problem
    locked = locked_coefficients(animation, problem.space.basis, problem.space.motors, problem.grid.end)
    kept = Checkpoint(checkpoint, problem_key(problem, locked, (options, tolerance)))
    searched = RetargetSearch(
        at, Search.start(start), character, animation, options, tolerance,
        lowest_frequency(prepared), adaptive, kept, progress,
    )  # fmt: skip
    searched.run(start, None if memory is None else memory.search)
    problem, search = searched.problem, searched.search
    if memory is not None:
        memory.search = SearchMemory.of(problem, search)
        memory.taken += [DIRECTIONS] if searched.took_over else []
    fixed = searched.hold()
    curves, x = found_curves(problem, len(character.motors), search.x)
    after = problem.at(x)
    # at a tempo of its own, limits cost time
    costs = {} if searched.interrupted or options.retime is not None else limit_costs(after, fixed)
    wall = time.perf_counter() - begin
    rows = left_out_rows(prepared)
    rows += search_rows(problem, character, curves, options, searched.idle_gain)
    return Result(
        reference=reference_motion(prepared.model, problem.grid, intended, problem.curves.angles),
        before=simulation_of(prepared, before.run, intended),
        after=simulation_of(prepared, after.run, intended),
        skins=skins(prepared.bodies),
        modes=mode_tables(prepared.bodies),
        curves=curves,
        objective_before=before.objective_value,
        objective_after=after.objective_value,
        search=searched.record(),
        wall_s=wall,
        step_s=problem.grid.h,
        pre_roll_s=problem.grid.pre_roll,
        dof=prepared.model.dof,
        left_out=tuple(rows),
        limits=limit_uses(_used(before, character, False), _used(after, character, True), problem.grid, costs),
        performed=performed_motion(prepared, after.curves),
        goal_m=goal_of(character, options.goal),
        terms=term_uses(before, after, character, options.terms),
    ).with_limits_told()


def _used(at: Evaluation, character: Character, shifted: bool) -> list[Excess]:
    """Use of all limits of the motors at a point, with what is known of finer steps or without."""
    bounds, limits = motor_bounds(character), at.problem.limits
    values = limited_values(at.problem.model, bounds, at.curves, at.run)
    if limits is not None and shifted:
        values |= {name: values[name] + by for name, by in limits.shifts.items()}
    return excesses(bounds, values, at.problem.grid.judged)
