"""What a search would refuse, from the shot's input alone: before meshes and finite elements are made."""

from __future__ import annotations

from calmotion.accuracy.run_checks import check_simulation
from calmotion.retargeting.optimize import refuse_other_integrators
from calmotion.retargeting.problem.posing import unknowns
from calmotion.shot import Animation, Character
from calmotion.shot.run import RunSettings


def check_search(character: Character, animation: Animation, options: RunSettings) -> None:
    """Refuse what a search would refuse.

    Raises:
        ShotError: A setting that is not supported, options that contradict each other, or no motor that may change.
    """
    refuse_other_integrators(options)
    unknowns(character, animation, check_simulation(character, animation, options), options)
