"""Simulate a shot whose motion is almost that of the last run: its choices are tried before they are made anew.

The last run's time step and subspaces cost six simulations, one of them with all coordinates. Two tell whether they
still do: one with twice the step, and one with more directions.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from calmotion.errors import IntegrationError
from calmotion.model import Result
from calmotion.model.run import RunSettings
from calmotion.multibody.parallel import in_parallel
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.simulate import Progress, simulate_shot
from calmotion.tolerance.pod_subspace import ProjectedShot, ReferenceRun
from calmotion.tolerance.reduced_bodies import RunMemory
from calmotion.tolerance.step_error import StepRun, distance, frames_of_result, run_or_none, simulate_at


def with_last_choices(
    shot: CompiledShot,
    options: RunSettings,
    progress: Progress,
    memory: RunMemory,
    allowed: Callable[[ReferenceRun], float],
) -> tuple[Result, ProjectedShot, StepRun, StepRun] | None:
    """The shot by the time step and in the subspaces of the last run; None where there is none, or targets leave them.

    Args:
        shot: Its bodies with all coordinates.
        allowed: Error that the subspaces may cause in a run [m].

    Returns:
        The result, the projected shot, the motion at the frames, and that by twice the step.

    Raises:
        ShotError: The shot cannot be simulated.
    """
    if memory.projected is None or not memory.step:
        return None
    projected = memory.projected.of_shot(shot, allowed)
    options = replace(options, integrator=memory.integrator)
    fine = replace(options, step=memory.step)
    progress(0.0, "simulating")
    tasks: tuple[Callable[[], Any], ...] = (
        lambda: simulate_shot(projected.shot, fine, lambda fraction, message: None),
        lambda: run_or_none(partial(simulate_at, projected.shot, options), 2.0 * memory.step),
        lambda: projected.finer_run(memory.step, fine),
    )
    try:
        result, coarse, finer = in_parallel(lambda task: task(), tasks)
    except IntegrationError:
        return None
    run = replace(frames_of_result(result, shot.animation.frame_times), integrator=memory.integrator)
    if coarse is None or coarse.step < 1.5 * run.step:
        return None
    off = 0.0 if finer is None else distance(run.positions, finer.positions)
    if off > allowed(ReferenceRun(shot.animation, run)):
        return None
    projected.error_m = max(projected.error_m, off)
    return result, projected, run, coarse
