"""Simulate or retarget a shot to a tolerance: the time step follows from the error that it causes at the targets.

Where no tolerance is asked for, the step is that of `time_grid.make_grid`; its error is estimated all the same after an
optimisation, where one more simulation costs next to nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from ..dynamics.schemes import SCHEMES
from ..fem.reduced_body import ReducedBody
from ..shot import Accuracy, Animation, Character, LeftOut, OptimizerStep, Result, Track
from ..shot.character import Array
from ..shot.needs import OFF
from .bodies import mode_tables
from .curves import sample_tracks
from .fast_scheme import by_fast_scheme
from .idle_motors import ENOUGH
from .motion_subspace import HeldBodies, Known, held_bodies
from .optimize import optimize_shot, refuse_other_integrators
from .prepare import Options, prepare
from .run import Progress, meant_motion, simulate_shot
from .step_error import ORDER, StepRun, distance, frames_of, largest_step, run_or_none, simulate_at, step_error
from .time_grid import MAX_STEP, make_grid

SHARE = 0.5  # of the tolerance, that the time step may take in any case
WHOLE = 0.8  # of the tolerance, that it may take together with what the bodies do without
FIRST, LAST = 1.0 / 60.0, 1.0 / 30720.0  # steps that are tried [s]
OF_SHAKE = 0.05  # of the input's own error: how well that need be known before it is taken away
# Where no tolerance is asked for, a simulation of what was written has all coordinates, and is to tell the same errors.
UNASKED = 0.002
HELD = 0.1  # of the tolerance (and of how well the shake need be known), that holding bodies to directions may take
NAMES = {"bdf2": "BDF2", "newmark": "Newmark's method", "generalized-alpha": "generalised-alpha"}
FINDING = "finding the directions that the shot bends links in"
MARGIN, MOST = 0.8, 3  # by which a step that was too large is made too small, and how often that is done
Bodies = Sequence[ReducedBody] | None


def simulate_to_tolerance(
    character: Character, animation: Animation, bodies: Bodies, options: Options, progress: Progress,
    left_out_m: float | None = None, known: Known | None = None,
) -> Result:  # fmt: skip
    """As `simulate_shot`, with what keeps the tolerance where one is asked for: directions of bodies, and a time step.

    Args:
        left_out_m: Error of what the bodies do without where it is known better than their own estimates [m].
        known: The shot, simulated with them; None: not known yet.
    """
    if options.tolerance is None:
        return simulate_shot(character, animation, bodies, options, progress)
    progress(0.0, FINDING)
    held = held_to_tolerance(character, animation, bodies, options, known)
    if not _chooses(character, options):
        return _with_modes(simulate_shot(character, animation, held.bodies, options, progress), bodies)
    progress(0.0, "choosing the time step")
    left_out = (_left_out(bodies) if left_out_m is None else left_out_m) + held.error_m

    def simulated(options: Options) -> Result:
        step, error = chosen_step(character, animation, held.bodies, options, left_out)
        result = simulate_shot(character, animation, held.bodies, replace(options, step=step), progress)
        accuracy = Accuracy(error, left_out, _mesh_error(bodies), options.tolerance)
        return _with_step(_with_modes(replace(result, accuracy=accuracy), bodies), character, options)

    return by_fast_scheme(options, simulated)


def held_to_tolerance(
    character: Character, animation: Animation, bodies: Bodies, options: Options, known: Known | None,
    shake: Callable[[StepRun], float] = lambda run: 0.0,
) -> HeldBodies:  # fmt: skip
    """The bodies in the directions that the shot needs, by its current curves.

    Args:
        known: The shot, simulated with the bodies, where that was done.
        shake: How far a run is from what is meant, where that will be taken away [m].
    """
    share = UNASKED if options.tolerance is None else HELD
    least = share * character.retarget.allowed(options.tolerance)
    step = _own_step(character, options)
    return held_bodies(
        character, animation, bodies, options, step, lambda item: max(least, share * OF_SHAKE * shake(item.run)), known
    )


def _own_step(character: Character, options: Options) -> float:
    """The step of a simulation for which none is chosen [s]."""
    return options.step or character.retarget.time_step or MAX_STEP


def _with_modes(result: Result, bodies: Bodies) -> Result:
    """The result with the frequencies of the bodies themselves, not of the directions that they were held to."""
    return replace(result, modes=mode_tables(bodies or ()))


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
        why = f"they keep the tolerance of {1e3 * (options.tolerance or 0.0):g} mm by {NAMES[options.scheme]}"
    else:
        why = "at 1/480 s motions of 10 Hz are simulated to better than a percent"
    return LeftOut(f"time steps shorter than {1e3 * step:.3g} ms", why, error)


def planned_step(character: Character, animation: Animation, bodies: Bodies, options: Options) -> LeftOut:
    """The step that a simulation of the shot as animated would take, and why, by simulating it."""
    if _chooses(character, options):
        held = held_to_tolerance(character, animation, bodies, options, None)
        left_out = _left_out(bodies) + held.error_m
        return by_fast_scheme(
            options,
            lambda options: step_row(
                character, options, *chosen_step(character, animation, held.bodies, options, left_out)
            ),
        )
    trial = partial(simulate_at, character, animation, bodies, options)
    fine = trial(options.step or character.retarget.time_step or MAX_STEP)
    coarse = run_or_none(trial, 2.0 * fine.step)
    error = None if coarse is None or coarse.step < 1.5 * fine.step else step_error(coarse, fine)
    return step_row(character, options, fine.step, error)


def chosen_step(
    character: Character, animation: Animation, bodies: Bodies, options: Options, left_out: float
) -> tuple[float, float]:
    """The step of a simulation to a tolerance, and its estimated error [s], [m]; arguments as of `simulate_shot`.

    It divides a frame.

    Args:
        left_out: Error of what the bodies do without [m].

    Raises:
        ShotError: Not even the last step does.
    """
    trial = partial(simulate_at, character, animation, bodies, options)
    step, error = largest_step(trial, FIRST, LAST, lambda run: _allowed(options, left_out))
    if not np.isfinite(error):
        trial(step)
    whole = make_grid(animation.frame_times, step, 0.0).h
    return whole, (whole / step) ** ORDER * error


def optimize_to_tolerance(
    character: Character, animation: Animation, bodies: Bodies, options: Options, progress: Progress,
    checkpoint: Path | None = None, known: Known | None = None,
) -> Result:  # fmt: skip
    """As `optimize_shot`, likewise, and with directions of bodies always.

    The search begins with a step at which the input's shake is known well enough to be taken away. What is left of it
    afterwards is known far better; where the tolerance asks for more, the search goes on with a finer step, and where
    the links bend in other directions by now with these as well.
    """
    refuse_other_integrators(options)
    input_shot = replace(animation, current=animation.tracks)
    intended = cache(partial(intended_motion, character, animation, bodies, options))

    def shake(run: StepRun) -> float:
        return distance(run.positions, intended())

    progress(0.0, FINDING)
    held = held_to_tolerance(character, input_shot, bodies, options, known, shake)
    chooses = _chooses(character, options)
    step = _own_step(character, options)
    if chooses:
        progress(0.0, "choosing the time step")
        trial = partial(simulate_at, character, input_shot, held.bodies, options)
        enough = _allowed(options, _left_out(held.bodies))
        step, _ = largest_step(trial, FIRST, LAST, lambda run: max(enough, OF_SHAKE * shake(run)))
    result: Result | None = None
    for _ in range(MOST):
        own = held.bodies
        of_step = replace(options, step=step) if chooses else options
        found = _searched(character, animation, own, of_step, progress, checkpoint)
        result = _with_modes(found if result is None else _added(result, found), bodies)
        if result.interrupted:
            break
        result = _estimated(result, character, animation, own, options)
        assert result.accuracy is not None
        animation = replace(animation, current=found_tracks(result, animation))
        allowed = _allowed(options, result.accuracy.left_out_m) if chooses else np.inf
        fine = result.accuracy.step_m <= allowed or step <= LAST
        ended = found.iterations >= options.max_iterations  # by its limit: it is not worth more
        if fine and (ended or held.hold_for(animation, _own_step(character, options))):
            break
        if not fine:
            step = max(LAST, MARGIN * result.step_s * (allowed / result.accuracy.step_m) ** (1.0 / ORDER))
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
    return options.scheme in SCHEMES and not character.retarget.cyclic


def _allowed(options: Options, left_out: float) -> float:
    """Error that the time step may cause beside what the bodies do without [m]."""
    assert options.tolerance is not None
    return max(SHARE * options.tolerance, WHOLE * options.tolerance - left_out)


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
