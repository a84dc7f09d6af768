"""The two jobs of the engine: simulate a shot as animated, and retarget it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..dynamics.model import Model, compile_model
from ..dynamics.modes import system_frequencies
from ..dynamics.simulation import SimulationFailure, Workspace
from ..dynamics.topology import span_tree
from ..errors import ShotError
from ..fem.reduced_body import ReducedBody
from ..shot import (
    Animation,
    Character,
    LeftOut,
    Motion,
    MotorCurve,
    OptimizerStep,
    Result,
    Simulation,
)
from ..shot.character import Array, IntArray
from .bodies import mode_tables, reduce_bodies, skins
from .curves import (
    KNOT_SPACING,
    OffsetBasis,
    TimeGrid,
    coefficient_bounds,
    make_basis,
    make_grid,
    needed_pre_roll,
    sample_tracks,
)
from .gauss_newton import Iterate, minimize
from .objective import Objective, Reference, rotation_errors
from .problem import ForwardRun, RetargetProblem, RigidMotion, compile_kernels, rigid_motion, run_forward

SMOOTHNESS = 1e-10
CLOSENESS = 1e-4  # an offset of 0.1 rad weighs as much as an error of 1 mm [m^2/rad^2]
TOLERANCE = 1e-3
UNCHANGED = 1e-5  # an offset that stays below this angle [rad] is none

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Options:
    """What the user overrides; None keeps the shot's own or the automatic choice. Lengths [m], times [s]."""

    tolerance: float | None = None
    step: float | None = None
    pre_roll: float | None = None
    integrator: str = "bdf2"
    knot_spacing: float | None = None
    smoothness: float | None = None
    max_iterations: int = 30


@dataclass(frozen=True, eq=False)
class Prepared:
    """A shot compiled for simulation."""

    character: Character
    bodies: Sequence[ReducedBody]
    model: Model
    grid: TimeGrid


def prepare(
    character: Character, animation: Animation, bodies: Sequence[ReducedBody] | None, options: Options
) -> Prepared:
    """Compile the system and the time grid.

    Raises:
        ShotError: Something the shot asks for is not supported.
    """
    _refuse_unsupported(character, options)
    if len(animation.frame_times) < 2:
        raise ShotError(
            "a shot of one frame has no motion",
            path=character.path,
            attribute="endTimeCode",
            remedy="Author startTimeCode and endTimeCode of the stage, at least a frame apart.",
        )
    tree = span_tree(character)
    if bodies is None:
        bodies = reduce_bodies(character, tree, None)
    model = compile_model(character, tree, bodies)
    pre_roll = options.pre_roll
    if pre_roll is None:
        pre_roll = needed_pre_roll(animation.tracks, animation.frame_times)
    step = options.step if options.step is not None else character.retarget.time_step
    return Prepared(character, bodies, model, make_grid(animation.frame_times, step, pre_roll))


def first_pose_frequencies(character: Character, animation: Animation, bodies: Sequence[ReducedBody] | None) -> Array:
    """Natural frequencies of the whole character in its first pose, motors held [Hz], ascending.

    Raises:
        ShotError: It has no static equilibrium there.
    """
    prepared = prepare(character, animation, bodies, Options(pre_roll=0.0))
    angles, _ = sample_tracks(animation.tracks, prepared.grid)
    try:
        return system_frequencies(prepared.model, prepared.model.joint_angles(angles[0]))
    except SimulationFailure as failure:
        raise _failure(prepared, failure) from failure


def _refuse_unsupported(character: Character, options: Options) -> None:
    settings = character.retarget
    for attribute, value, supported in (
        ("calm:retarget:reference", settings.reference, "rigid"),
        ("calm:retarget:cyclic", settings.cyclic, False),
    ):
        if value != supported:
            raise ShotError(
                "this setting is not supported yet",
                path=character.path,
                attribute=attribute,
                found=value,
                remedy=f"Set it to {str(supported).lower()} for now.",
            )
    if options.integrator != "bdf2":
        raise ShotError(
            "this integrator is not available",
            attribute="--integrator",
            found=options.integrator,
            remedy="Use bdf2.",
        )


def _failure(prepared: Prepared, failure: SimulationFailure) -> ShotError:
    """A failed step in the user's words: which body, which joint, when."""
    tree, character = prepared.model.tree, prepared.character
    joint = character.joints[tree.joint[failure.component]]
    when = failure.time_s - prepared.grid.pre_roll
    return ShotError(
        f"the simulation {_REASONS[failure.reason]} at {when:.3f} s, first at the joint {joint.path}",
        path=character.bodies[tree.body[failure.component]].path,
        remedy="Try a smaller --step; check the masses, the material and the motion of this joint there.",
    )


_REASONS = {
    "singular": "meets a singular system",
    "diverged": "diverges",
    "no static equilibrium": "finds no static equilibrium",
}


def _by_body(model: Model, values: Array, axis: int = 1) -> Array:
    """Reorder an axis of components to the character's bodies."""
    order = np.empty(len(model.tree.body), int)
    order[list(model.tree.body)] = np.arange(len(order))
    return np.take(values, order, axis=axis)


def _simulated_motion(model: Model, grid: TimeGrid, run: ForwardRun, motors: int) -> Motion:
    states = run.trajectory.states
    component = {body: k for k, body in enumerate(model.tree.body)}
    elastic = tuple(
        states.u[:, component[b], : model.system.elastic[component[b]]].copy() for b in range(len(component))
    )
    values, efforts = np.zeros((len(states.c), motors)), np.zeros((len(states.c), motors))
    for k, motor in enumerate(model.motor):
        if motor >= 0:
            values[:, motor] = run.joint_angles[:, k] * model.sign[k]
            efforts[:, motor] = states.lam[:, k, 5] * model.sign[k]
    return Motion(
        grid.times, _by_body(model, states.c), _by_body(model, states.q), elastic, values, efforts,
        run.target_positions, run.target_rotations,
    )  # fmt: skip


def _reference_motion(model: Model, grid: TimeGrid, rigid: RigidMotion, angles: Array) -> Motion:
    total = len(rigid.c)
    return Motion(
        grid.times, _by_body(model, rigid.c), _by_body(model, rigid.q),
        tuple(np.zeros((total, 0)) for _ in model.tree.body), angles, np.full_like(angles, np.nan),
        rigid.target_positions, rigid.target_rotations,
    )  # fmt: skip


def _simulation(model: Model, grid: TimeGrid, run: ForwardRun, reference: Reference, motors: int) -> Simulation:
    turned, _ = rotation_errors(reference.rotations, run.target_rotations)
    return Simulation(
        motion=_simulated_motion(model, grid, run, motors),
        position_errors=np.linalg.norm(run.target_positions - reference.positions, axis=2),
        rotation_errors=np.linalg.norm(turned, axis=2),
        newton_iterations=run.trajectory.newton_iterations,
        max_joint_gap=run.trajectory.max_joint_gap,
        wall_s=run.trajectory.wall_s,
    )


def _left_out(prepared: Prepared, animation: Animation) -> list[LeftOut]:
    character, grid = prepared.character, prepared.grid
    rigid = [body.path for body in character.bodies if body.flexible is None]
    rows = [LeftOut("finite elements of " + ", ".join(rigid), "rigid: no CalmFlexibleBodyAPI")] if rigid else []
    rows += [
        LeftOut("nonlinear elasticity of " + body.path, "deflections are taken as small")
        for body in character.bodies
        if body.flexible is not None and body.flexible.elasticity == "auto"
    ]
    if grid.pre_steps == 0:
        rows.append(LeftOut("pre-roll", "the shot starts at rest"))
    locked = [motor.path for motor in character.motors if not motor.optimize]
    rows += [LeftOut("optimisation of " + path, "calm:motor:optimize is false") for path in locked]
    return rows


def simulate_shot(
    character: Character,
    animation: Animation,
    bodies: Sequence[ReducedBody] | None,
    options: Options,
    progress: Progress,
) -> Result:
    """Simulate the shot as animated, and measure it against the rigid motion of the animator's intent."""
    prepared = prepare(character, animation, bodies, options)
    model, grid = prepared.model, prepared.grid
    workspace = Workspace.for_system(model.system)
    angles, rates = sample_tracks(animation.current, grid)
    meant, meant_rates = sample_tracks(animation.tracks, grid)
    try:
        rigid = rigid_motion(model, meant, meant_rates, grid.h)
        progress(0.0, "compiling kernels, once")
        run_forward(model, workspace, angles[:3], rates[:3], grid.h)
        begin = time.perf_counter()
        run = run_forward(model, workspace, angles, rates, grid.h, lambda fraction: progress(fraction, "simulating"))
        wall = time.perf_counter() - begin
    except SimulationFailure as failure:
        raise _failure(prepared, failure) from failure
    objective = Objective.over(model, rigid.reference, grid.times, grid.h)
    residuals, _ = objective.residuals(run.target_positions, run.target_rotations)
    return Result(
        reference=_reference_motion(model, grid, rigid, meant),
        before=_simulation(model, grid, run, rigid.reference, len(character.motors)),
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
        left_out=tuple(_left_out(prepared, animation)),
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
    prepared = prepare(character, animation, bodies, options)
    model, grid = prepared.model, prepared.grid
    angles, rates = sample_tracks(animation.tracks, grid)
    spacing = options.knot_spacing or settings.knot_spacing or KNOT_SPACING
    smoothness = next(v for v in (options.smoothness, settings.smoothness, SMOOTHNESS) if v is not None)
    tolerance = options.tolerance or settings.tolerance or TOLERANCE
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
        rigid = rigid_motion(model, angles, rates, grid.h)
        objective = Objective.over(model, rigid.reference, grid.times, grid.h)
        problem = RetargetProblem(
            model, grid, angles, rates, objective, basis, motors, smoothness, CLOSENESS, gain=0.01 * tolerance
        )
        progress(0.0, "compiling kernels, once")
        compile_kernels(model, Workspace.for_system(model.system), angles, rates, grid.h)
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
        raise _failure(prepared, failure) from failure
    if not np.isfinite(after_value):
        raise ShotError(
            "the simulation of the input diverges",
            path=character.path,
            remedy="Run `calmotion simulate` on the shot to see where, or try a smaller --step.",
        )
    return Result(
        reference=_reference_motion(model, grid, rigid, angles),
        before=_simulation(model, grid, before, rigid.reference, len(character.motors)),
        after=_simulation(model, grid, problem.run, rigid.reference, len(character.motors)),
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
        left_out=tuple(_left_out(prepared, animation)),
    )
