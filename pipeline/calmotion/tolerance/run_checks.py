"""What a simulation would refuse, from the shot's input alone: before meshes and finite elements are made."""

from dataclasses import replace

from calmotion.errors import ShotError
from calmotion.model import Animation, Character
from calmotion.model.run import RunSettings
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.inputs.supported import refuse_fast_motors, refuse_half_turns, refuse_unsupported
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.preparation import grid_of
from calmotion.tolerance.step_choice import FIRST, LAST, chooses_step


def check_simulation(character: Character, animation: Animation, options: RunSettings) -> TimeGrid:
    """Refuse what a simulation of a shot would refuse; the grid of its first step otherwise.

    Raises:
        ShotError: A setting that is not supported, or a motor that turns by half a turn within the shortest step.
    """
    refuse_unsupported(character, animation, options)
    _refuse_long_step(character, animation, options)
    chooses = chooses_step(character, options)
    grid = grid_of(character, animation, replace(options, step=FIRST) if chooses else options)
    for tracks in {id(tracks): tracks for tracks in (animation.tracks, animation.current)}.values():
        curves = sample_curves(tracks, grid)
        if chooses:  # a longer step that fails is halved
            refuse_fast_motors(character, grid, curves.rates, LAST)
        else:
            refuse_half_turns(character, grid, curves.angles)
    return grid


def _refuse_long_step(character: Character, animation: Animation, options: RunSettings) -> None:
    """Refuse a step that is longer than the shot: it was mostly meant in milliseconds.

    Raises:
        ShotError: It is.
    """
    step = character.retarget.time_step if options.step is None else options.step
    end = float(animation.frame_times[-1])
    if step is not None and step > end:
        raise ShotError(
            "the time step is longer than the shot",
            path=character.path,
            attribute="calm:retarget:timeStep" if options.step is None else "--step",
            found=f"{step:g} s, where the shot lasts {end:g} s",
            remedy="Use milliseconds, such as 5ms, or leave it out.",
        )
