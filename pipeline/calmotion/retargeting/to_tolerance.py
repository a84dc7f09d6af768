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

MARGIN, MOST = 0.8, 3  # safety factor of a new step, and most searches


def optimize_to_tolerance(
    character: Character, animation: Animation, bodies: Bodies, options: Options, progress: Progress,
    checkpoint: Path | None = None, known: ReferenceRun | None = None,
) -> Result:  # fmt: skip
    """As `optimize_shot`, with the time step and the POD subspaces of the bodies chosen by their errors.

    The first search uses a step that resolves the vibration of the input to a share of its size. The remaining
    vibration is much smaller, so its error is known afterwards; if it exceeds the tolerance, the search continues with
    a finer step, and if the deflections have left the POD subspaces, with new ones.
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
        reduced = held.bodies
        of_step = replace(options, step=step) if chooses else options
        latest = _searched(character, animation, reduced, of_step, progress, checkpoint)
        result = with_modes(latest if result is None else _continued(result, latest), bodies)
        if result.interrupted:
            break
        result = _estimated(result, character, animation, reduced, options)
        assert result.accuracy is not None
        animation = replace(animation, current=found_tracks(result, animation))
        allowed = allowed_step_error(options, result.accuracy.left_out_m) if chooses else np.inf
        fine = result.accuracy.step_m <= allowed or step <= LAST
        ended = latest.iterations >= options.max_iterations  # a new POD subspace would allow no further iteration
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
    """One search; it continues with the idle motors if these would gain too much."""
    first = optimize_shot(character, animation, bodies, options, progress, checkpoint)
    enough = ENOUGH * character.retarget.allowed(options.tolerance)
    if first.interrupted or first.idle_gain_m is None or first.idle_gain_m <= enough or options.motors == OFF:
        return first
    motors = tuple(replace(motor, idle=False) for motor in character.motors)
    animation = replace(animation, current=found_tracks(first, animation))
    every = replace(character, motors=motors)
    return _continued(first, optimize_shot(every, animation, bodies, options, progress, checkpoint))


def _estimated(result: Result, character: Character, animation: Animation, bodies: Bodies, options: Options) -> Result:
    """The result with its accuracy, from a simulation of its curves with twice the step."""
    fine = frames_of(result, animation.frame_times)
    trial = partial(
        simulate_at, character, replace(animation, current=found_tracks(result, animation)), bodies, options
    )
    coarse = run_or_none(trial, 2.0 * result.step_s)
    if coarse is None or coarse.step < 1.5 * fine.step:  # it failed, or the step cannot be longer than a frame
        coarse, fine = fine, trial(0.5 * result.step_s)
    accuracy = Accuracy(step_error(coarse, fine), omitted_error(bodies), mesh_error(bodies), options.tolerance)
    return with_step(replace(result, accuracy=accuracy), character, options)


def _continued(first: Result, second: Result) -> Result:
    """The result of the second search, with the work of both."""
    done = first.steps[-1]
    steps = tuple(
        OptimizerStep(
            s.objective, s.gradient_norm, done.forward_simulations + s.forward_simulations,
            done.linearized_sweeps + s.linearized_sweeps,
        )
        for s in second.steps
    )  # fmt: skip
    return replace(
        second,
        steps=first.steps + steps,
        gradients=first.gradients + second.gradients,
        linearized_sweeps=first.linearized_sweeps + second.linearized_sweeps,
        forward_simulations=first.forward_simulations + second.forward_simulations,
        iterations=first.iterations + second.iterations,
        wall_s=first.wall_s + second.wall_s,
    )
