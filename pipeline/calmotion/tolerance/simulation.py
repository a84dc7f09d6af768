"""Simulate a shot to its tolerance: the time step follows from the error that it causes at the targets.

A step that the user or the shot gives is not changed; its error is estimated all the same, by one more simulation.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Accuracy, Animation, Character, MotorCurve, Result, Simplification, Track
from calmotion.model.curves import optimized_curve
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import STEP, SUBSPACE, tolerance_of
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.parallel import at_once
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.simulation.bodies import mode_tables
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.inputs.time_grid import MAX_STEP
from calmotion.simulation.preparation import failure_error, prepare
from calmotion.simulation.simulate import Progress, intended_motion, simulate_shot
from calmotion.tolerance.integrator_choice import by_fast_scheme
from calmotion.tolerance.meshes.mesh_budget import mesh_error
from calmotion.tolerance.pod_subspace import ProjectedShot, ReferenceRun, project_to_subspace
from calmotion.tolerance.reduced_bodies import SUBSPACES, TIME_STEP, RunMemory
from calmotion.tolerance.simulate_again import with_last_choices
from calmotion.tolerance.step_choice import FIRST, allowed_step_error, chooses_step, chosen_step
from calmotion.tolerance.step_error import (
    StepRun,
    effort_errors,
    frames_of_result,
    order_of,
    run_or_none,
    simulate_at,
    step_error,
)

OF_SHAKE = 0.05  # of the input's own error: how well that need be known before it is taken away
HELD = 0.1  # of the tolerance (and of how well the shake need be known), that holding bodies to directions may take
NAMES = {"bdf2": "BDF2", "newmark": "Newmark's method", "generalized-alpha": "generalised-alpha"}
FINDING = "choosing the subspace of the deformations in this shot"


def simulate_to_tolerance(
    shot: CompiledShot, options: RunSettings, progress: Progress, left_out_m: float | None = None,
    known: ReferenceRun | None = None, memory: RunMemory | None = None,
) -> Result:  # fmt: skip
    """As `simulate_shot`, with POD subspaces of the bodies and a time step that keep the tolerance.

    Args:
        left_out_m: Error of what the bodies do without where it is known better than their own estimates [m].
        known: The shot, simulated with them; None: not known yet.
        memory: Of the last run, whose choices are tried first, and which takes those of this one.
    """
    character, chooses = shot.character, chooses_step(shot.character, options)
    left_out_m = omitted_error(shot.bodies) if left_out_m is None else left_out_m
    again = None if memory is None or not chooses else _simulated_again(shot, options, progress, left_out_m, memory)
    if again is not None:
        return again
    progress(0.0, FINDING)
    projected = project_to_tolerance(shot, options, known)
    left_out = left_out_m + projected.error_m
    if chooses:
        progress(0.0, "choosing the time step")

    def simulated(options: RunSettings) -> Result:
        if not chooses:
            result = simulate_shot(projected.shot, options, progress)
            return with_accuracy(with_modes(result, shot.bodies), projected.shot, options, left_out)
        trials: list[StepRun] = []
        step, error = chosen_step(projected.shot, options, left_out, trials)
        result = with_modes(simulate_shot(projected.shot, replace(options, step=step), progress), shot.bodies)
        run = replace(frames_of_result(result, shot.animation.frame_times), integrator=options.scheme)
        if memory is not None:
            memory.projected, memory.step, memory.integrator = projected, step, options.scheme
        accuracy = _accuracy(error, left_out, projected.shot, options, run)
        return with_step(result, character, options, replace(accuracy, efforts=_effort_errors(run, trials)))

    # a search by the same given step uses BDF2 as well, and what it wrote shall have the same errors
    return by_fast_scheme(options, simulated) if chooses else simulated(options)


def _simulated_again(
    shot: CompiledShot, options: RunSettings, progress: Progress, left_out_m: float, memory: RunMemory
) -> Result | None:
    """The result by the choices of the last run, where they still keep the tolerance; else None."""
    character = shot.character
    found = with_last_choices(shot, options, progress, memory, allowed_by_subspaces(character, options))
    if found is None:
        return None
    result, projected, run, coarse = found
    error, left_out = step_error(coarse, run), left_out_m + projected.error_m
    options = replace(options, integrator=memory.integrator)
    accuracy = _accuracy(error, left_out, projected.shot, options, coarse)  # differences of runs need no fine step
    kept = accuracy.estimated_m <= tolerance_of(character, options.tolerance)
    if not kept and error > allowed_step_error(character, options, besides_step(accuracy)):
        return None
    result = with_modes(result, shot.bodies)
    memory.taken += [SUBSPACES, TIME_STEP]
    return with_step(result, character, options, replace(accuracy, efforts=effort_errors(run, coarse)))


def with_accuracy(result: Result, shot: CompiledShot, options: RunSettings, left_out: float) -> Result:
    """The result with its accuracy, from a simulation of its curves with half the step.

    One with twice the step costs less, but tells too little: where steps are long, a vibration that they damp away is
    missing in both.

    Args:
        shot: With the curves of the result.
        left_out: Error of what the bodies do without [m].
    """
    own = replace(frames_of_result(result, shot.animation.frame_times), integrator=options.scheme)
    fine, mesh = at_once(
        partial(simulate_at, shot, options, 0.5 * result.step_s), partial(mesh_error, shot, options, own)
    )
    ratio = (own.step / fine.step) ** order_of(shot.character)
    accuracy = Accuracy(ratio * step_error(own, fine), left_out, mesh, _subspace_error(shot.bodies))
    accuracy = replace(accuracy, efforts=effort_errors(own, fine))
    return with_step(result, shot.character, options, accuracy)


def with_subspaces(result: Result, shot: CompiledShot) -> Result:
    """The result with what bodies in POD subspaces tell of their error by now.

    Args:
        shot: With these bodies.
    """
    told = {row.what: row for body in shot.bodies for row in body.left_out if row.source == SUBSPACE}
    known = result.accuracy
    assert known is not None
    accuracy = replace(known, left_out_m=omitted_error(shot.bodies), subspace_m=_subspace_error(shot.bodies))
    return replace(result, left_out=tuple(told.get(row.what, row) for row in result.left_out), accuracy=accuracy)


def project_to_tolerance(
    shot: CompiledShot, options: RunSettings, known: ReferenceRun | None,
    shake: Callable[[StepRun], float] = lambda run: 0.0,
) -> ProjectedShot:  # fmt: skip
    """The shot with its bodies in the directions that it needs, by its current curves.

    Args:
        known: The shot, simulated with the bodies, where that was done.
        shake: How far a run is from what is intended, where that will be taken away [m].
    """
    allowed = allowed_by_subspaces(shot.character, options, shake)
    return project_to_subspace(shot, options, own_step(shot.character, options), allowed, known)


def allowed_by_subspaces(
    character: Character, options: RunSettings, shake: Callable[[StepRun], float] = lambda run: 0.0
) -> Callable[[ReferenceRun], float]:
    """Error that POD subspaces may cause in a run [m]; arguments as of `project_to_tolerance`."""
    least = HELD * tolerance_of(character, options.tolerance)
    return lambda item: max(least, HELD * OF_SHAKE * shake(item.run))


def own_step(character: Character, options: RunSettings) -> float:
    """The step of a simulation for which none is chosen [s]."""
    return options.step or character.retarget.time_step or MAX_STEP


def with_modes(result: Result, bodies: Sequence[ReducedBody]) -> Result:
    """The result with the frequencies of the bodies themselves, not those of their POD subspaces."""
    return replace(result, modes=mode_tables(bodies))


def with_step(result: Result, character: Character, options: RunSettings, accuracy: Accuracy) -> Result:
    """The result with its accuracy, and with its time step among the simplifications."""
    row = step_row(character, options, result.step_s, accuracy.step_m)
    return replace(result, accuracy=accuracy, left_out=(*result.left_out, row))


def step_row(character: Character, options: RunSettings, step: float, error: float | None) -> Simplification:
    """Why steps [s] are no shorter, and their error at the targets [m]."""
    given = options.step if options.step is not None else character.retarget.time_step
    name = "--step" if options.step is not None else "calm:retarget:timeStep"
    if given is not None:
        divides = "" if abs(step - given) < 1e-3 * given else f" ({1e3 * given:.4g} ms): frames are divided into steps"
        why = f"given by {name}{divides}"
    elif chooses_step(character, options):
        tolerance = tolerance_of(character, options.tolerance)
        why = f"it keeps the tolerance of {1e3 * tolerance:.4g} mm with {NAMES[options.scheme]}"
    else:
        why = "steps of 1/480 s simulate motions of 10 Hz to better than one percent"
    return Simplification(f"time step {1e3 * step:.3g} ms", why, error, STEP)


def planned_step(shot: CompiledShot, options: RunSettings) -> Simplification:
    """The step that a simulation of the shot as animated would take, and why, by simulating it."""
    character = shot.character
    if chooses_step(character, options):
        projected = project_to_tolerance(shot, options, None)
        left_out = omitted_error(shot.bodies) + projected.error_m
        return by_fast_scheme(
            options, lambda options: step_row(character, options, *chosen_step(projected.shot, options, left_out))
        )
    trial = partial(simulate_at, shot, options)
    fine = trial(own_step(character, options))
    coarse = run_or_none(trial, 2.0 * fine.step)
    error = None if coarse is None or coarse.step < 1.5 * fine.step else step_error(coarse, fine)
    return step_row(character, options, fine.step, error)


def _effort_errors(run: StepRun, trials: Sequence[StepRun]) -> Array | None:
    """`effort_errors` by that of some other runs whose step differs most."""
    others = [other for other in trials if other.efforts is not None and other.integrator == run.integrator]
    other = max(others, key=lambda other: abs(np.log(other.step / run.step)), default=None)
    return None if other is None else effort_errors(run, other)


def besides_step(accuracy: Accuracy) -> float:
    """Estimated errors of all but the time step [m], as far as they are known."""
    return accuracy.left_out_m + (accuracy.mesh_m or 0.0)


def omitted_error(bodies: Sequence[ReducedBody]) -> float:
    """Estimated error of what the bodies do without [m]; along a chain it adds up."""
    return sum(row.estimated_error_m or 0.0 for body in bodies for row in body.left_out)


def _subspace_error(bodies: Sequence[ReducedBody]) -> float:
    """The part of it of their POD subspaces [m]."""
    rows = [row for body in bodies for row in body.left_out]
    return sum(row.estimated_error_m or 0.0 for row in rows if row.source == SUBSPACE)


def _accuracy(step: float, left_out: float, shot: CompiledShot, options: RunSettings, run: StepRun) -> Accuracy:
    """The estimates for a run: of its step, of what its bodies do without, and of their meshes [m]."""
    return Accuracy(step, left_out, mesh_error(shot, options, run), _subspace_error(shot.bodies))


def intended_positions(shot: CompiledShot, options: RunSettings) -> Array:
    """Intended positions of the targets at the frames [m], shape [f, K, 3].

    Raises:
        ShotError: A pose whose sag counts has no static equilibrium.
    """
    prepared = prepare(shot, replace(options, step=FIRST))
    try:
        intended = intended_motion(prepared, *sample_tracks(shot.animation.tracks, prepared.grid))
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure
    return intended.target_positions[prepared.grid.frames]


def found_tracks(result: Result, animation: Animation) -> tuple[Track, ...]:
    """The curves that were found: samples at the frames hold them exactly, but for what was animated between."""
    frames = animation.frame_times

    def found(curve: MotorCurve, track: Track) -> Track:
        if not curve.changed:
            return track
        if animation.tempo is None or len(track.times) <= len(frames):
            return Track(frames, curve.frame_values)
        return Track(track.times, optimized_curve(animation, curve, False)(track.times, 0), track.corners)

    return tuple(map(found, result.curves, animation.tracks))
