"""Retarget a shot to a tolerance: the time step and the subspace of the bodies follow from the errors they cause."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from calmotion.accuracy.pod_subspace import ReferenceRun
from calmotion.accuracy.simulate_to_tolerance import (
    FINDING,
    FIRST,
    LAST,
    OF_SHAKE,
    Bodies,
    allowed_step_error,
    chooses_step,
    found_tracks,
    intended_positions,
    mesh_error,
    omitted_error,
    own_step,
    project_to_tolerance,
    with_modes,
    with_step,
)
from calmotion.accuracy.step_error import (
    ORDER,
    StepRun,
    distance,
    frames_of,
    largest_step,
    run_or_none,
    simulate_at,
    step_error,
)
from calmotion.retargeting.optimize import optimize_shot, refuse_other_integrators
from calmotion.retargeting.simplification.idle_motors import ENOUGH
from calmotion.shot import Accuracy, Animation, Character, OptimizerStep, Result
from calmotion.shot.model_choice import OFF
from calmotion.simulation.prepare import Options
from calmotion.simulation.simulate import Progress

MARGIN, MOST = 0.8, 3  # by which a step that was too large is made too small, and how often that is done


def optimize_to_tolerance(
    character: Character, animation: Animation, bodies: Bodies, options: Options, progress: Progress,
    checkpoint: Path | None = None, known: ReferenceRun | None = None,
) -> Result:  # fmt: skip
    """As `optimize_shot`, likewise, and with directions of bodies always.

    The search begins with a step at which the input's shake is known well enough to be taken away. What is left of it
    afterwards is known far better; where the tolerance asks for more, the search goes on with a finer step, and where
    the links bend in other directions by now with these as well.
    """
    refuse_other_integrators(options)
    input_shot = replace(animation, current=animation.tracks)
    intended = cache(partial(intended_positions, character, animation, bodies, options))

    def shake(run: StepRun) -> float:
        return distance(run.positions, intended())

    progress(0.0, FINDING)
    held = project_to_tolerance(character, input_shot, bodies, options, known, shake)
    chooses = chooses_step(character, options)
    step = own_step(character, options)
    if chooses:
        progress(0.0, "choosing the time step")
        trial = partial(simulate_at, character, input_shot, held.bodies, options)
        enough = allowed_step_error(options, omitted_error(held.bodies))
        step, _ = largest_step(trial, FIRST, LAST, lambda run: max(enough, OF_SHAKE * shake(run)))
    result: Result | None = None
    for _ in range(MOST):
        own = held.bodies
        of_step = replace(options, step=step) if chooses else options
        found = _searched(character, animation, own, of_step, progress, checkpoint)
        result = with_modes(found if result is None else _added(result, found), bodies)
        if result.interrupted:
            break
        result = _estimated(result, character, animation, own, options)
        assert result.accuracy is not None
        animation = replace(animation, current=found_tracks(result, animation))
        allowed = allowed_step_error(options, result.accuracy.left_out_m) if chooses else np.inf
        fine = result.accuracy.step_m <= allowed or step <= LAST
        ended = found.iterations >= options.max_iterations  # by its limit: it is not worth more
        if fine and (ended or held.hold_for(animation, own_step(character, options))):
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


def _estimated(result: Result, character: Character, animation: Animation, bodies: Bodies, options: Options) -> Result:
    """The result with its accuracy, from a simulation of the curves that were found by twice the step."""
    fine = frames_of(result, animation.frame_times)
    trial = partial(
        simulate_at, character, replace(animation, current=found_tracks(result, animation)), bodies, options
    )
    coarse = run_or_none(trial, 2.0 * result.step_s)
    if coarse is None or coarse.step < 1.5 * fine.step:  # it fails, or a frame is no longer than the step
        coarse, fine = fine, trial(0.5 * result.step_s)
    accuracy = Accuracy(step_error(coarse, fine), omitted_error(bodies), mesh_error(bodies), options.tolerance)
    return with_step(replace(result, accuracy=accuracy), character, options)


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
