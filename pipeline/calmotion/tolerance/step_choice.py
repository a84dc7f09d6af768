"""The longest time step that keeps the tolerance, and its error, confirmed by a run with half of it."""

from collections.abc import Callable

import numpy as np

from calmotion.model import Character
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.multibody.integrators.coefficients import IMPLICIT
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.open_chains import refused_gap
from calmotion.simulation.inputs.time_grid import make_grid
from calmotion.tolerance.meshes.mesh_budget import mesh_error
from calmotion.tolerance.step_error import (
    StepRun,
    between,
    largest_step,
    order_of,
    run_or_none,
    simulate_at,
    step_error,
)

# Of the tolerance, that the time step may take: the least and the most where the tolerance can be kept, with all else,
# as estimates of another step differ, and where it cannot: smaller steps would be in vain
LEAST, MOST, WHOLE, MISSED = 0.1, 0.75, 0.9, 0.35
_ANEW = 0.3  # step over that by which the other errors were estimated, below which they are again
FIRST, LAST = 1.0 / 60.0, 1.0 / 30720.0  # steps that are tried [s]
_MORE = 1.1  # of what is allowed: where a run with half the step tells more, the step becomes shorter


def chooses_step(character: Character, options: RunSettings) -> bool:
    """Whether the step follows from the tolerance; it does not for cyclic motions and RK4."""
    if options.step is not None or character.retarget.time_step is not None:
        return False
    return options.scheme in IMPLICIT and not character.retarget.cyclic


def chosen_step(
    shot: CompiledShot, options: RunSettings, left_out: float, trials: list[StepRun] | None = None
) -> tuple[float, float]:
    """The step of a simulation to a tolerance, and its estimated error [s], [m]; arguments as of `simulate_shot`.

    It divides a frame, or nearly so: simulations take the next shorter one that does.

    Args:
        left_out: Error of what the bodies do without [m].
        trials: Filled with the runs by which it was chosen.

    Raises:
        ShotError: Not even the last step does.
    """

    def trial(step: float) -> StepRun:
        whole = make_grid(shot.animation.frame_times, step, 0.0).h
        if whole not in runs:
            runs[whole] = simulate_at(shot, options, step)
        run = runs[whole]
        if trials is not None and step <= FIRST:
            trials[:] = [*trials[-1:], run]  # of each only what two frames hold
        return run

    def allowed(run: StepRun) -> float:
        """What the meshes leave; they cost about the same by any step."""
        if not known or run.step < _ANEW * known[0]:
            known[:] = run.step, mesh_error(shot, options, run) or 0.0
        return allowed_step_error(shot.character, options, left_out + known[1])

    runs: dict[float, StepRun] = {}  # by their steps: one that is chosen, or half of it, was often tried before
    known: list[float] = []  # the step by which they were estimated, and what they cost
    step, error = largest_step(trial, FIRST, LAST, allowed, refused_gap(shot.character, options))
    whole = make_grid(shot.animation.frame_times, step, 0.0).h
    if not np.isfinite(error):
        trial(step)
        return whole, error
    return confirmed_step(trial, whole, (whole / step) ** order_of(shot.character) * error, LAST, allowed)


def confirmed_step(
    run: Callable[[float], StepRun], step: float, error: float, last: float, allowed: Callable[[StepRun], float]
) -> tuple[float, float]:
    """A step and its error by a run with half of it too; a shorter one where that is more than is allowed.

    Longer steps tell too little where they hardly resolve a vibration: two that damp it away differ little. Where half
    of the step does not resolve it either, longer ones may tell more: the larger error counts.

    Args:
        run: Simulates by a step [s]; may raise IntegrationError.
        step, error: The step [s] and its error by longer ones [m].
        last: Shortest step [s].
        allowed: Error that may be [m], from the finest run.

    Returns:
        The step [s] and its error [m].
    """
    longest, told = step, error
    own, half = run_or_none(run, step), run_or_none(run, 0.5 * step)
    while own is not None and half is not None and half.step < own.step:
        enough = allowed(half)
        step, error = own.step, (own.step / half.step) ** half.order * step_error(own, half)
        if error <= _MORE * enough or half.step <= last:
            if own.step < longest:  # not all of the next longer one, which was too long
                return between(own, error, enough, half.order)
            return step, max(error, told)
        own, half = half, run_or_none(run, 0.5 * half.step)
    return step, error


def allowed_step_error(character: Character, options: RunSettings, others: float) -> float:
    """Error that the time step may cause beside all other errors [m].

    It takes what they leave of the tolerance: half the step costs less than a finer mesh or reduction.
    """
    return step_allowance(tolerance_of(character, options.tolerance), others)


def step_allowance(tolerance: float, others: float) -> float:
    """The same by the tolerance [m]."""
    left = WHOLE * tolerance - others
    return min(MOST * tolerance, left) if left >= LEAST * tolerance else MISSED * tolerance
