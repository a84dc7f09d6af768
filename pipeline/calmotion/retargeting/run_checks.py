"""What a search would refuse, from the shot's input alone: before meshes and finite elements are made."""

from calmotion.model import Animation, Character
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import refuse_other_integrators
from calmotion.retargeting.problem.posing import unknowns
from calmotion.retargeting.retiming.settings import refuse_tempo
from calmotion.retargeting.robust.retarget import uncertainties_of
from calmotion.retargeting.search_terms import refuse_terms
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.run_checks import check_simulation


def check_search(character: Character, animation: Animation, options: RunSettings) -> None:
    """Refuse what a search would refuse.

    Raises:
        ShotError: A setting that is not supported, options that contradict each other, no motor that may change, or
            a robot of which nothing is uncertain, to be robust against.
    """
    refuse_other_integrators(options)
    refuse_terms(options, character)
    if options.retime is not None:
        refuse_tempo(character, animation, options.retime)
    if options.robust is not None:
        uncertainties_of(compile_shot(character, animation))
    unknowns(character, animation, check_simulation(character, animation, options), options)
