"""The two jobs of the engine: simulate a shot as animated, and retarget it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from ..dynamics.failure import SimulationFailure
from ..dynamics.simulation import Workspace
from ..errors import ShotError
from ..fem.reduced_body import ReducedBody
from ..shot import Animation, Character, MotorCurve, OptimizerStep, Result
from ..shot.character import DEFAULT_TOLERANCE, Array, IntArray
from .bodies import mode_tables, skins
from .curves import KNOT_SPACING, OffsetBasis, TimeGrid, coefficient_bounds, make_basis, sample_tracks
from .gauss_newton import Iterate, minimize
from .objective import Objective
from .prepare import Options, failure_error, prepare, refuse_half_turns
from .problem import RetargetProblem, compile_kernels, rigid_motion, run_forward
from .report import left_out_rows, reference_motion, simulation_of

SMOOTHNESS = 1e-10
CLOSENESS = 1e-4  # an offset of 0.1 rad weighs as much as an error of 1 mm [m^2/rad^2]
UNCHANGED = 1e-5  # an offset that stays below this angle [rad] is none

Progress = Callable[[float, str], None]


def simulate_shot(
    character: Character,
    animation: Animation,
    bodies: Sequence[ReducedBody] | None,
    options: Options,
    progress: Progress,
) -> Result:
    """Simulate the shot as animated, and measure it against the rigid motion of the animator's intent."""
    prepared = prepare(character, animation, bodies, options)
    model, grid, world = prepared.model, prepared.grid, prepared.world
    workspace = Workspace.for_system(model.system)
    angles, rates = sample_tracks(animation.current, grid)
    meant, meant_rates = sample_tracks(animation.tracks, grid)
    refuse_half_turns(prepared, angles)
    try:
        rigid = rigid_motion(model, meant, meant_rates, grid.h, world)
        progress(0.0, "compiling kernels, once")
        run_forward(model, workspace, angles[:3], rates[:3], grid.h, world[:3], integrator=options.integrator)
        begin = time.perf_counter()
        run = run_forward(
            model, workspace, angles, rates, grid.h, world, lambda fraction: progress(fraction, "simulating"),
            options.integrator,
        )  # fmt: skip
        wall = time.perf_counter() - begin
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure
    objective = Objective.over(model, rigid.reference, grid.times, grid.h)
    residuals, _ = objective.residuals(run.target_positions, run.target_rotations)
    return Result(
        reference=reference_motion(model, grid, rigid, meant),
        before=simulation_of(model, grid, run, rigid.reference, len(character.motors)),
        after=None,
        skins=skins(prepared.bodies),
        modes=mode_tables(prepared.bodies),
        curves=(),
        steps=(),
        objective_before=0.5 * float(np.sum(residuals**2)),
        objective_after=None,
        gradients=0,
        linearized_sweeps=0,
        forward_simulations=1,
        iterations=0,
        parameters=0,
        wall_s=wall,
        step_s=grid.h,
        pre_roll_s=grid.pre_roll,
        dof=model.dof,
        left_out=tuple(left_out_rows(prepared)),
    )


def _bounds(character: Character, grid: TimeGrid, basis: OffsetBasis, angles: Array, motors: IntArray) -> Array:
    """Bounds of all unknowns, ordered by basis function, then motor, shape [P * M, 2]."""
    columns = []
    for motor in motors:
        joint = character.joints[character.motors[motor].joint]
        columns.append(coefficient_bounds(basis, grid, angles[:, motor], joint.lower, joint.upper))
    return np.stack(columns, axis=1).reshape(-1, 2)


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
        input_at_frames = problem.angles[grid.frames, motor]
        largest = float(np.max(np.abs(offsets[:, column[motor]]))) if motor in column else 0.0
        changed = largest > UNCHANGED
        values = input_at_frames
        if changed:
            values = input_at_frames + basis.at_frames @ coefficients[:, column[motor]]
        elif motor in column:
            coefficients[:, column[motor]] = 0.0
        curves.append(MotorCurve(motor, changed, basis.knots, values, largest if changed else 0.0))
    return tuple(curves), coefficients.ravel()


def _progress_of(iterates: Sequence[Iterate]) -> tuple[OptimizerStep, ...]:
    return tuple(OptimizerStep(i.value, i.gradient_norm, i.evaluations, 2 * i.products) for i in iterates)


def optimize_shot(
    character: Character,
    animation: Animation,
    bodies: Sequence[ReducedBody] | None,
    options: Options,
    progress: Progress,
) -> Result:
    """Retarget a shot: change its motor curves so that the flexible robot moves as the rigid one was animated to."""
    settings = character.retarget
    if options.integrator != "bdf2":
        raise ShotError(
            "derivatives are those of BDF2 alone",
            attribute="--integrator",
            found=options.integrator,
            remedy="Leave it out, or use it with `calmotion simulate`.",
        )
    prepared = prepare(character, animation, bodies, options)
    model, grid, world = prepared.model, prepared.grid, prepared.world
    angles, rates = sample_tracks(animation.tracks, grid)
    refuse_half_turns(prepared, angles)
    spacing = options.knot_spacing or settings.knot_spacing or KNOT_SPACING
    smoothness = next(v for v in (options.smoothness, settings.smoothness, SMOOTHNESS) if v is not None)
    tolerance = options.tolerance or settings.tolerance or DEFAULT_TOLERANCE
    basis = make_basis(grid, spacing, settings.endpoints == "kept")
    motors = np.array([k for k, motor in enumerate(character.motors) if motor.optimize], dtype=np.int32)
    if not basis.count:
        raise ShotError(
            "the shot is too short to change anything between its kept end poses",
            path=character.path,
            attribute="calm:retarget:endpoints",
            found=settings.endpoints,
            remedy="Set it to free, or lengthen the shot to five frames or more.",
        )
    if not len(motors):
        raise ShotError(
            "every motor is locked, so there is nothing to optimise",
            path=character.path,
            attribute="calm:motor:optimize",
            remedy="Set it to true on the motors that may change.",
        )
    try:
        rigid = rigid_motion(model, angles, rates, grid.h, world)
        objective = Objective.over(model, rigid.reference, grid.times, grid.h)
        problem = RetargetProblem(
            model, grid, angles, rates, objective, basis, motors, smoothness, CLOSENESS, 0.01 * tolerance, world
        )
        progress(0.0, "compiling kernels, once")
        compile_kernels(model, Workspace.for_system(model.system), angles, rates, grid.h, world)
        begin = time.perf_counter()
        problem.value(np.zeros(problem.size))
        before = problem.run
        before_value = 0.5 * float(
            np.sum(objective.residuals(before.target_positions, before.target_rotations)[0] ** 2)
        )

        def report(iterate: Iterate, x: Array) -> None:
            rms = np.sqrt(2.0 * iterate.value / problem._unit) * 1e3
            done = min(0.95, 0.1 + 0.12 * len(iterates))
            iterates.append(iterate)
            progress(done, f"optimising: weighted error {rms:.3f} mm, {iterate.evaluations} simulations")

        iterates: list[Iterate] = []
        solution = minimize(
            problem, _start(basis, animation, motors, grid), _bounds(character, grid, basis, angles, motors),
            max_iterations=options.max_iterations, on_iterate=report,
        )  # fmt: skip
        curves, x = _curves(problem, len(character.motors), solution.x)
        after_value = problem.value(x)
        wall = time.perf_counter() - begin
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure
    if not np.isfinite(after_value):
        raise ShotError(
            "the simulation of the input diverges",
            path=character.path,
            remedy="Run `calmotion simulate` on the shot to see where, or try a smaller --step.",
        )
    return Result(
        reference=reference_motion(model, grid, rigid, angles),
        before=simulation_of(model, grid, before, rigid.reference, len(character.motors)),
        after=simulation_of(model, grid, problem.run, rigid.reference, len(character.motors)),
        skins=skins(prepared.bodies),
        modes=mode_tables(prepared.bodies),
        curves=curves,
        steps=_progress_of(solution.history),
        objective_before=before_value,
        objective_after=after_value,
        gradients=solution.gradients,
        linearized_sweeps=2 * solution.products + solution.gradients,
        forward_simulations=solution.evaluations + 2,
        iterations=len(solution.history),
        parameters=problem.size,
        wall_s=wall,
        step_s=grid.h,
        pre_roll_s=grid.pre_roll,
        dof=model.dof,
        left_out=tuple(left_out_rows(prepared)),
    )
