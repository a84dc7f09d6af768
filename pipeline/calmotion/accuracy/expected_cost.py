"""The time and memory that a run will take, estimated from the size of the shot before anything is spent."""

from __future__ import annotations

import math
from dataclasses import dataclass

from calmotion.errors import ShotError
from calmotion.shot import Animation, Character
from calmotion.shot.run import RunSettings
from calmotion.simulation.inputs.time_grid import make_grid

# Measured on the five samples: 1.5 to 2.9 us for a step and a coordinate; a search costs 40 to 300 simulations.
SECONDS = 3e-6  # for a step and a coordinate
SEARCH = 200.0  # simulations of a search
ELASTIC = 10  # elastic coordinates of a flexible body whose modes are not chosen yet
COPIES, COPIES_OF_SEARCH = 3, 6  # states of all instants that a simulation and a search have at once


@dataclass(frozen=True)
class ExpectedCost:
    """Attributes:
    frames, steps: Of the shot; the steps with those of the pre-roll that the user requests.
    coordinates: Of the robot.
    hours: Processor time [h].
    memory: In bytes.
    """

    frames: int
    steps: int
    coordinates: int
    hours: float
    memory: float


def expected_cost(character: Character, animation: Animation, options: RunSettings, searches: bool) -> ExpectedCost:
    """The cost of simulating a shot, or of a search on it; of the order of the real one.

    Args:
        options: With the step, where one is given.
        searches: Whether the motor curves are optimised.
    """
    frames = len(animation.frame_times)
    steps = 1
    if frames > 1:
        pre_roll = options.pre_roll or 0.0
        grid = make_grid(animation.frame_times, options.step or character.retarget.time_step, pre_roll)
        steps = grid.pre_steps + grid.substeps * (frames - 1) + 1
    flexible = [body.flexible for body in character.bodies if body.flexible is not None]
    modes = [settings.mode_count if settings.mode_count > 0 else ELASTIC for settings in flexible]
    coordinates = 6 * len(character.bodies) + sum(modes)
    # arrays have a row for each body, as wide as the largest; see `multibody.model.system.State`
    numbers = len(character.bodies) * (16 + 2 * max(modes, default=0)) + 6 * len(character.joints)
    copies = COPIES_OF_SEARCH if searches else COPIES
    hours = SECONDS * steps * coordinates * (SEARCH if searches else 1.0) / 3600.0
    return ExpectedCost(frames, steps, coordinates, hours, 8.0 * copies * numbers * steps)


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
        otherwise = "or use a longer --step"
    elif cost.hours > most_hours:
        needs = f"{readable_hours(cost.hours)}, more than the allowed {readable_hours(most_hours)}"
        allowed = math.ceil(1.5 * cost.hours)
        otherwise = f"use a longer --step, or allow more with --set accuracy.analyse.max_hours={allowed}"
    else:
        return
    raise ShotError(
        f"the run needs about {needs}",
        path=path,
        attribute="endTimeCode",
        found=f"{cost.frames} frames in {cost.steps} steps of {cost.coordinates} coordinates",
        remedy="Shorten the shot (startTimeCode, endTimeCode) or its --pre-roll, process it in parts, lower "
        "framesPerSecond, " + otherwise,
    )


def readable_hours(hours: float) -> str:
    """Hours as text: minutes below two hours, days from two days on."""
    if hours < 2.0:
        minutes = max(1, round(60.0 * hours))
        return "a minute" if minutes == 1 else f"{minutes} minutes"
    return f"{hours:.0f} hours" if hours < 48.0 else f"{hours / 24.0:.0f} days"
