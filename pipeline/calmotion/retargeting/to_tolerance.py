"""Retarget a shot to a tolerance: the time step and the subspace of the bodies follow from the errors they cause."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from calmotion.errors import IntegrationError
from calmotion.model import Character, Result, Track
from calmotion.model.limits.use import is_kept
from calmotion.model.model_choice import OFF
from calmotion.model.result import GOAL_REACHED
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.multibody.parallel import at_once
from calmotion.retargeting.found_curves import best_so_far
from calmotion.retargeting.input_run import with_input_resolved
from calmotion.retargeting.left_out import JOINING_GAIN
from calmotion.retargeting.optimize import optimize_shot, refuse_other_integrators
from calmotion.retargeting.robust.retarget import retarget_robustly
from calmotion.retargeting.search_progress import SuccessiveSearches
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.open_chains import refused_gap
from calmotion.simulation.simulate import Progress
from calmotion.tolerance.pod_subspace import ProjectedShot, ReferenceRun
from calmotion.tolerance.reduced_bodies import SUBSPACES, TIME_STEP, RunMemory
from calmotion.tolerance.simulation import (
    FINDING,
    HELD,
    allowed_by_subspaces,
    besides_step,
    found_tracks,
    intended_positions,
    omitted_error,
    own_step,
    project_to_tolerance,
    with_accuracy,
    with_modes,
    with_subspaces,
)
from calmotion.tolerance.step_choice import FIRST, LAST, allowed_step_error, chooses_step
from calmotion.tolerance.step_error import StepRun, distance, frames_of_result, largest_step, order_of, simulate_at

STEP_SAFETY, SEARCHES = 0.8, 3  # safety factor of a new step, and most searches
DIVIDED = 4  # most times that the step of a search is halved since only shorter ones can simulate where it begins
FIRST_STEP = 0.2  # of the shake: the error that the step of the first search may have


def optimize_to_tolerance(
    shot: CompiledShot, options: RunSettings, progress: Progress, checkpoint: Path | None = None,
    known: ReferenceRun | None = None, memory: RunMemory | None = None,
) -> Result:  # fmt: skip
    """As `optimize_shot`, with the time step and the POD subspaces of the bodies chosen by their errors.

    The first search uses a step that resolves the vibration of the input to a fifth of its size. The remaining
    vibration is much smaller, so its error is known afterwards; if it exceeds the tolerance, the search continues with
    a finer step, and if the deflections have left the POD subspaces, with new ones. At the end the input is simulated
    by steps that resolve it, unless the shot is almost that of the last run.

    Args:
        memory: Of the last run, whose choices the first search takes, and which takes those of this one.
    """
    refuse_other_integrators(options)
    character, animation = shot.character, shot.animation
    intended = cache(partial(intended_positions, shot, options))

    def shake(run: StepRun) -> float:
        return distance(run.positions, intended())

    progress(0.0, FINDING)
    memory = memory or RunMemory()
    again = memory.projected is not None
    if memory.projected is not None:
        projected = memory.projected.of_shot(shot, allowed_by_subspaces(character, options, shake))
    else:
        projected = project_to_tolerance(shot.with_tracks(animation.tracks), options, known, shake)
    chooses = chooses_step(character, options)
    step = own_step(character, options)
    if chooses and again and memory.step:
        step = memory.step
    elif chooses:
        progress(0.0, "choosing the time step")
        step = _first_step(projected.shot, options, shake)
    result, tracks, searches, left = None, animation.current, SuccessiveSearches(progress), False
    for number in range(SEARCHES):
        reduced = projected.shot.with_tracks(tracks)
        try:
            latest, step = _by_steps(step, chooses, partial(_searched, reduced, searches, checkpoint, memory), options)
            searches.ended()
            memory.searched = reduced
            result = with_modes(latest if result is None else continued(result, latest), shot.bodies)
            if result.interrupted:
                break
            tracks = found_tracks(result, animation)
            # a new POD subspace would allow no further iteration
            ended = latest.search.iterations >= options.max_iterations
            unknown = not again and not number and not ended  # later searches end near the motion of the first
            result, accurate = _with_accuracy(result, reduced, projected, tracks, options, unknown)
            accuracy = result.accuracy
            assert accuracy is not None
            allowed = allowed_step_error(character, options, besides_step(accuracy)) if chooses else np.inf
            fine = accuracy.step_m <= allowed or step <= LAST
            step = step if fine else _finer_step(result.step_s, allowed / accuracy.step_m, character)
            # a search under limits follows where the tempo does not keep them
            left = options.limited_by_tempo and not all(map(is_kept, latest.limits))
            if fine and accurate is None and not left:
                accurate = ended or _is_accurate(projected, tracks, result, options)
                result = with_subspaces(result, projected.shot) if accurate else result
            if (fine and accurate) or left:
                if again and not number:
                    memory.taken += [SUBSPACES, *([TIME_STEP] if chooses and memory.step else [])]
                memory.projected, memory.step = projected, result.step_s if fine else step
                break
        except (IntegrationError, KeyboardInterrupt) as end:
            if result is None:
                raise
            # what the last search found stays, with its error
            result = best_so_far(result) if isinstance(end, KeyboardInterrupt) else result
            break
    assert result is not None
    if options.robust is not None and not result.interrupted:
        searches.ended()
        reduced, of_step = projected.shot, replace(options, step=result.step_s if chooses else options.step)
        result = with_modes(_robustly(reduced, of_step, options, result, searches), shot.bodies)
    if not chooses or again or left or result.interrupted:
        return result
    return with_input_resolved(result, reduced.with_tracks(animation.tracks), options)


def _finer_step(step: float, ratio: float, character: Character) -> float:
    """A step whose error is so many times that of another [s]."""
    return max(LAST, STEP_SAFETY * step * float(ratio ** (1.0 / order_of(character))))


def _first_step(shot: CompiledShot, options: RunSettings, shake: Callable[[StepRun], float]) -> float:
    """The step of the first search [s], by how far a run of the input is from what is intended [m]."""
    enough = allowed_step_error(shot.character, options, omitted_error(shot.bodies))
    step, _ = largest_step(
        partial(simulate_at, shot, options),
        FIRST,
        LAST,
        lambda run: max(enough, FIRST_STEP * shake(run)),
        refused_gap(shot.character, options),
    )
    return step


def _robustly(
    shot: CompiledShot, of_step: RunSettings, options: RunSettings, nominal: Result, searches: SuccessiveSearches
) -> Result:
    """The result for a set of robots, begun from that for the nominal one."""
    animation = shot.animation
    robust = retarget_robustly(shot.with_tracks(animation.tracks), of_step, nominal, continued, searches)
    if robust.interrupted:
        return robust
    reduced = shot.with_tracks(found_tracks(robust, animation))
    try:
        return with_accuracy(robust, reduced, options, omitted_error(reduced.bodies))
    except KeyboardInterrupt:
        return best_so_far(robust)


def _with_accuracy(
    result: Result, shot: CompiledShot, projected: ProjectedShot, tracks: tuple[Track, ...], options: RunSettings,
    complete: bool,
) -> tuple[Result, bool | None]:  # fmt: skip
    """The result with its accuracy, and whether the subspaces do for its curves: None where that was not asked.

    Args:
        complete: Whether the curves are simulated with all coordinates, at the same time.
    """
    told = partial(with_accuracy, result, shot.with_tracks(tracks), options, omitted_error(shot.bodies))
    if not complete:
        return told(), None
    with_all, known = at_once(told, partial(_complete_run, projected, tracks, result, options))
    accurate = None if known is None else projected.is_accurate_for(known)
    # the motion that was found leaves the directions by less than that of the input
    return (with_subspaces(with_all, projected.shot) if accurate else with_all), accurate


def _complete_run(
    projected: ProjectedShot, tracks: tuple[Track, ...], result: Result, options: RunSettings
) -> ReferenceRun | None:
    return projected.complete_run(tracks, max(result.step_s, own_step(projected.shot.character, options)))


def _is_accurate(projected: ProjectedShot, tracks: tuple[Track, ...], result: Result, options: RunSettings) -> bool:
    """Whether the subspaces of almost the same motion do for the curves that were found; if not, they are chosen anew.

    More directions tell, and all of them only where these do not do.
    """
    animation, character = projected.shot.animation, projected.shot.character
    finer = projected.finer_run(result.step_s, options, tracks)
    if finer is None:
        return True
    off = distance(finer.positions, frames_of_result(result, animation.frame_times).positions)
    if off <= HELD * tolerance_of(character, options.tolerance):
        projected.tell(max(off, projected.error_m))
        return True
    return projected.is_accurate_for(_complete_run(projected, tracks, result, options))


def _by_steps(
    step: float, chooses: bool, search: Callable[[RunSettings], Result], options: RunSettings
) -> tuple[Result, float]:
    """One search and its step [s]: with a shorter one where only that can simulate where it begins.

    Simulations divide such steps, which have no derivatives then.
    """
    least = step / 2**DIVIDED
    while True:
        try:
            return search(replace(options, step=step) if chooses else options), step
        except IntegrationError:
            if not chooses or step <= least:
                raise
            step *= 0.5


def _searched(
    shot: CompiledShot, progress: SuccessiveSearches, checkpoint: Path | None, memory: RunMemory, options: RunSettings
) -> Result:
    """One search; it continues with the idle motors if these would gain too much."""
    character = shot.character
    first = _search(shot, options, progress, checkpoint, memory)
    enough = JOINING_GAIN * tolerance_of(character, options.tolerance)
    gain = first.search.idle_gain_m
    if first.interrupted or gain is None or gain <= enough or options.motors == OFF:
        return first
    if first.search.stopped == GOAL_REACHED:
        return first
    progress.ended()
    motors = tuple(replace(motor, idle=False) for motor in character.motors)
    every = shot.with_tracks(found_tracks(first, shot.animation)).with_character(replace(character, motors=motors))
    return continued(first, _search(every, options, progress, checkpoint, memory))


def _search(
    shot: CompiledShot, options: RunSettings, progress: SuccessiveSearches, checkpoint: Path | None, memory: RunMemory
) -> Result:
    """One search, with its processor time."""
    begin = time.process_time()
    found = optimize_shot(shot, options, progress, checkpoint, memory=memory)
    return replace(found, search=replace(found.search, processor_s=time.process_time() - begin))


def continued(first: Result, second: Result) -> Result:
    """The result of the second search, with the work of both."""
    return replace(second, search=second.search.after(first.search), wall_s=first.wall_s + second.wall_s)
