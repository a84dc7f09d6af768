"""The time and memory that a run will take, estimated from the size of the shot before anything is spent."""

import math
from dataclasses import dataclass

from calmotion.errors import ShotError
from calmotion.model import Animation, Character
from calmotion.model.run import RunSettings
from calmotion.simulation.inputs.time_grid import MAX_STEP, make_grid

# Measured on the five samples: 1.5 to 2.9 us for a step and a coordinate; a search costs 40 to 300 simulations.
SECONDS = 3e-6  # for a step and a coordinate
SEARCH = 200.0  # simulations of a search
MANY_MODES = 1000  # of a body: more are what costs
ELASTIC = 10  # elastic coordinates of a flexible body whose modes are not chosen yet
_FINE = 0.1  # of the usual step: steps that are shorter are what costs
_SHORTEN = (
    "Shorten the shot (startTimeCode, endTimeCode), process it in parts, lower framesPerSecond, or use a longer --step"
)
_REMEDIES = {
    "--step": "Use a longer --step, or leave it out",
    "calm:retarget:timeStep": "Author a longer time step, or none",
    "--pre-roll": "Use a shorter --pre-roll, or leave it out",
    "calm:flexible:modeCount": "Author fewer modes, or -1, so that the tolerance decides",
}
COPIES, COPIES_OF_SEARCH = 3, 6  # states of all instants that a simulation and a search have at once


@dataclass(frozen=True)
class ExpectedCost:
    """Attributes:
    frames, steps: Of the shot; the steps with those of the pre-roll that the user requests.
    cause: The option that makes most of the steps, where the user gave one.
    coordinates: Of the robot.
    hours: Processor time [h].
    memory: In bytes.
    """

    frames: int
    steps: int
    coordinates: int
    hours: float
    memory: float
    cause: str = ""


def expected_cost(character: Character, animation: Animation, options: RunSettings, searches: bool) -> ExpectedCost:
    """The cost of simulating a shot, or of a search on it; of the order of the real one.

    Args:
        options: With the step, where one is given.
        searches: Whether the motor curves are optimised.
    """
    frames = len(animation.frame_times)
    steps, cause = 1, ""
    if frames > 1:
        pre_roll = options.pre_roll or 0.0
        grid = make_grid(animation.frame_times, options.step or character.retarget.time_step, pre_roll)
        steps = grid.pre_steps + grid.substeps * (frames - 1) + 1
        if 2 * grid.pre_steps > steps:
            cause = "--pre-roll"
        elif grid.substeps > 1 and grid.h < _FINE * MAX_STEP:
            cause = "--step" if options.step is not None else "calm:retarget:timeStep"
    flexible = [body.flexible for body in character.bodies if body.flexible is not None]
    modes = [settings.mode_count if settings.mode_count > 0 else ELASTIC for settings in flexible]
    coordinates = 6 * len(character.bodies) + sum(modes)
    if max(modes, default=0) > MANY_MODES:
        cause = "calm:flexible:modeCount"
    # arrays have a row for each body, as wide as the largest; see `multibody.model.system.State`
    numbers = len(character.bodies) * (16 + 2 * max(modes, default=0)) + 6 * len(character.joints)
    copies = COPIES_OF_SEARCH if searches else COPIES
    hours = SECONDS * steps * coordinates * (SEARCH if searches else 1.0) / 3600.0
    return ExpectedCost(frames, steps, coordinates, hours, 8.0 * copies * numbers * steps, cause)


def refuse_unaffordable(cost: ExpectedCost, path: str, most_hours: float, available: float) -> None:
    """Refuse a run that would take more memory than there is, or more hours than the user allows.

    Args:
        path: Of the character.
        most_hours: Allowed [h].
        available: Memory [bytes].

    Raises:
        ShotError: With the estimate.
    """
    if cost.memory > available:
        needs = f"{cost.memory / 1e9:.1f} GB of memory, and {available / 1e9:.1f} GB are available"
        otherwise = ""
    elif cost.hours > most_hours:
        needs = f"{readable_hours(cost.hours)}, more than the allowed {readable_hours(most_hours)}"
        otherwise = f", or allow more with --set accuracy.analyse.max_hours={math.ceil(1.5 * cost.hours)}"
    else:
        return
    remedy = _REMEDIES.get(cost.cause, _SHORTEN)
    raise ShotError(
        f"the run needs about {needs}",
        path=path,
        attribute=cost.cause or "endTimeCode",
        found=f"{cost.frames} frames in {cost.steps} steps of {cost.coordinates} coordinates",
        remedy=f"{remedy}{otherwise}",
    )


def readable_hours(hours: float) -> str:
    """Hours as text: minutes below two hours, days from two days on."""
    if hours < 0.5 / 60.0:
        return "less than a minute"
    if hours < 2.0:
        minutes = max(1, round(60.0 * hours))
        return "a minute" if minutes == 1 else f"{minutes} minutes"
    return f"{hours:.0f} hours" if hours < 48.0 else f"{hours / 24.0:.0f} days"
