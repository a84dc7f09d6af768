"""Simulate or retarget a shot to a tolerance: the time step follows from the error that it causes at the targets.

Where no tolerance is asked for, the step is that of `time_grid.make_grid`; its error is estimated all the same after an
optimisation, where one more simulation costs next to nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ..fem.reduced_body import ReducedBody
from ..shot import Accuracy, Animation, Character, LeftOut, OptimizerStep, Result, Track
from ..shot.character import Array
from ..shot.needs import OFF
from .curves import sample_tracks
from .idle_motors import ENOUGH
from .optimize import optimize_shot
from .prepare import Options, prepare
from .run import Progress, meant_motion, simulate_shot
from .step_error import ORDER, StepRun, distance, frames_of, largest_step, run_or_none, simulate_at, step_error
from .time_grid import MAX_STEP

SHARE = 0.5  # of the tolerance, that the time step may take
FIRST, LAST = 1.0 / 60.0, 1.0 / 30720.0  # steps that are tried [s]
OF_SHAKE = 0.05  # of the input's own error: how well that need be known before it is taken away
MARGIN, MOST = 0.8, 3  # by which a step that was too large is made too small, and how often that is done
Bodies = Sequence[ReducedBody] | None


def simulate_to_tolerance(
    character: Character, animation: Animation, bodies: Bodies, options: Options, progress: Progress,
    left_out_m: float | None = None,
) -> Result:  # fmt: skip
    """As `simulate_shot`, with a time step that keeps the tolerance where one is asked for and no step is.

    Args:
        left_out_m: Error of what the bodies do without where it is known better than their own estimates [m].
    """
    if not _chooses(character, options):
        return simulate_shot(character, animation, bodies, options, progress)
    progress(0.0, "choosing the time step")
    step, error = chosen_step(character, animation, bodies, options)
    result = simulate_shot(character, animation, bodies, replace(options, step=step), progress)
    left_out = _left_out(bodies) if left_out_m is None else left_out_m
    accuracy = Accuracy(error, left_out, _mesh_error(bodies), options.tolerance)
    return _with_step(replace(result, accuracy=accuracy), character, options)


def _with_step(result: Result, character: Character, options: Options) -> Result:
    """The result with its time step among what was left out: finer ones, and what they would change."""
    assert result.accuracy is not None
    row = step_row(character, options, result.step_s, result.accuracy.step_m)
    return replace(result, left_out=(*result.left_out, row))


def step_row(character: Character, options: Options, step: float, error: float | None) -> LeftOut:
    """Why steps [s] are no shorter, and their error at the targets [m]."""
    if options.step is not None:
        why = "the step was asked for"
    elif character.retarget.time_step is not None:
        why = "calm:retarget:timeStep says so"
    elif _chooses(character, options):
        why = f"they keep the tolerance of {1e3 * (options.tolerance or 0.0):g} mm"
    else:
        why = "at 1/480 s motions of 10 Hz are simulated to better than a percent"
    return LeftOut(f"time steps shorter than {1e3 * step:.3g} ms", why, error)


def planned_step(character: Character, animation: Animation, bodies: Bodies, options: Options) -> LeftOut:
    """The step that a simulation of the shot as animated would take, and why, by simulating it."""
    if _chooses(character, options):
        return step_row(character, options, *chosen_step(character, animation, bodies, options))
    trial = partial(simulate_at, character, animation, bodies, options)
    fine = trial(options.step or character.retarget.time_step or MAX_STEP)
    coarse = run_or_none(trial, 2.0 * fine.step)
    error = None if coarse is None or coarse.step < 1.5 * fine.step else step_error(coarse, fine)
    return step_row(character, options, fine.step, error)


def chosen_step(character: Character, animation: Animation, bodies: Bodies, options: Options) -> tuple[float, float]:
    """The step of a simulation to a tolerance, and its estimated error [s], [m]; arguments as of `simulate_shot`."""
    trial = partial(simulate_at, character, animation, bodies, options)
    return largest_step(trial, FIRST, LAST, lambda run: _allowed(options))


def optimize_to_tolerance(
    character: Character, animation: Animation, bodies: Bodies, options: Options, progress: Progress,
    checkpoint: Path | None = None,
) -> Result:  # fmt: skip
    """As `optimize_shot`, likewise.

    The search begins with a step at which the input's shake is known well enough to be taken away. What is left of it
    afterwards is known far better; where the tolerance asks for more, the search goes on with a finer step.
    """
    run = partial(_searched, character, bodies=bodies, progress=progress, checkpoint=checkpoint)
    if not _chooses(character, options):
        found = run(animation, options=options)
        return found if found.interrupted else _estimated(found, character, animation, bodies, options)
    progress(0.0, "choosing the time step")
    intended = intended_motion(character, animation, bodies, options)

    def allowed(tried: StepRun) -> float:
        return max(_allowed(options), OF_SHAKE * distance(tried.positions, intended))

    trial = partial(simulate_at, character, replace(animation, current=animation.tracks), bodies, options)
    step, _ = largest_step(trial, FIRST, LAST, allowed)
    result: Result | None = None
    for _ in range(MOST):
        found = run(animation, options=replace(options, step=step))
        result = found if result is None else _added(result, found)
        if result.interrupted:
            return result
        result = _estimated(result, character, animation, bodies, options)
        assert result.accuracy is not None
        if result.accuracy.step_m <= _allowed(options) or step <= LAST:
            break
        step = max(LAST, MARGIN * result.step_s * (_allowed(options) / result.accuracy.step_m) ** (1.0 / ORDER))
        animation = replace(animation, current=found_tracks(result, animation))
    assert result is not None
    return result


def _searched(
    character: Character, animation: Animation, bodies: Bodies, options: Options, progress: Progress,
    checkpoint: Path | None,
) -> Result:  # fmt: skip
    """One search; where motors that were left out of it promise too much it goes on with them."""
    found = optimize_shot(character, animation, bodies, options, progress, checkpoint)
    enough = ENOUGH * character.retarget.allowed(options.tolerance)
    if found.interrupted or found.idle_gain_m is None or found.idle_gain_m <= enough or options.motors == OFF:
        return found
    motors = tuple(replace(motor, idle=False) for motor in character.motors)
    animation = replace(animation, current=found_tracks(found, animation))
    every = replace(character, motors=motors)
    return _added(found, optimize_shot(every, animation, bodies, options, progress, checkpoint))


def _chooses(character: Character, options: Options) -> bool:
    """Whether the step is to follow from the tolerance."""
    if options.tolerance is None or options.step is not None or character.retarget.time_step is not None:
        return False
    return options.integrator == "bdf2" and not character.retarget.cyclic


def _allowed(options: Options) -> float:
    assert options.tolerance is not None
    return SHARE * options.tolerance


def _left_out(bodies: Bodies) -> float:
    """Estimated error of what the bodies do without [m]; along a chain it adds up."""
    return sum(row.estimated_error_m or 0.0 for body in bodies or () for row in body.left_out)


def _mesh_error(bodies: Bodies) -> float | None:
    """That of their meshes [m]; None where nothing is flexible, or one of them is not known."""
    errors = [body.mesh_error_m for body in bodies or () if len(body.stiffness)]
    known = [error for error in errors if error is not None]
    return sum(known) if errors and len(known) == len(errors) else None


def intended_motion(character: Character, animation: Animation, bodies: Bodies, options: Options) -> Array:
    """Where the targets are meant to be at the frames [m], shape [f, K, 3]."""
    prepared = prepare(character, animation, bodies, replace(options, step=FIRST))
    meant = meant_motion(prepared, *sample_tracks(animation.tracks, prepared.grid))
    return meant.reference.positions[prepared.grid.frames]


def found_tracks(result: Result, animation: Animation) -> tuple[Track, ...]:
    """The curves that were found: samples at the frames hold them exactly."""
    return tuple(
        Track(animation.frame_times, curve.frame_values) if curve.changed else track
        for curve, track in zip(result.curves, animation.tracks, strict=True)
    )


def _estimated(result: Result, character: Character, animation: Animation, bodies: Bodies, options: Options) -> Result:
    """The result with its accuracy, from a simulation of the curves that were found by twice the step."""
    fine = frames_of(result, animation.frame_times)
    trial = partial(
        simulate_at, character, replace(animation, current=found_tracks(result, animation)), bodies, options
    )
    coarse = run_or_none(trial, 2.0 * result.step_s)
    if coarse is None or coarse.step < 1.5 * fine.step:  # it fails, or a frame is no longer than the step
        coarse, fine = fine, trial(0.5 * result.step_s)
    accuracy = Accuracy(step_error(coarse, fine), _left_out(bodies), _mesh_error(bodies), options.tolerance)
    return _with_step(replace(result, accuracy=accuracy), character, options)


def _added(first: Result, then: Result) -> Result:
    """A search that went on: its last part, with the work of both."""
    done = first.steps[-1]
    steps = tuple(
        OptimizerStep(
            s.objective, s.gradient_norm, done.forward_simulations + s.forward_simulations,
            done.linearized_sweeps + s.linearized_sweeps,
        )
        for s in then.steps
    )  # fmt: skip
    return replace(
        then,
        steps=first.steps + steps,
        gradients=first.gradients + then.gradients,
        linearized_sweeps=first.linearized_sweeps + then.linearized_sweeps,
        forward_simulations=first.forward_simulations + then.forward_simulations,
        iterations=first.iterations + then.iterations,
        wall_s=first.wall_s + then.wall_s,
    )
