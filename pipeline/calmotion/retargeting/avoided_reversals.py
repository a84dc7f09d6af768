"""The search with the play of gears in its objective (`optimize --avoid-reversals`)."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Character
from calmotion.model.run import RunSettings
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.problem.reversals import reversal_terms, transmitted_by
from calmotion.retargeting.problem.rigid_approximation import rigid_response

OPTION = "--avoid-reversals"


def refuse_without_play(character: Character, options: RunSettings) -> None:
    """Refuse to avoid reversals where that cannot be done.

    Raises:
        ShotError: No motor has play, or the adjoint is continuous.
    """
    if not options.avoid_reversals:
        return
    if not np.any(play_of(character)):
        raise ShotError(
            "no motor has play, so there are no reversals to avoid",
            path=character.path,
            attribute="calm:motor:backlash",
            found=0.0,
            remedy=f"Author it on the joints whose gears have play, or leave out {OPTION}",
        )
    if options.adjoint == "continuous":
        raise ShotError(
            f"the continuous adjoint does not support {OPTION}",
            path=character.path,
            attribute="retarget.optimize.adjoint",
            found=options.adjoint,
            remedy="Use the discrete adjoint.",
        )


def play_of(character: Character) -> Array:
    """Play of the gears of all motors [rad or m], shape [M]."""
    return np.array([motor.backlash for motor in character.motors], float)


def count_reversals(problem: RetargetProblem, play: Array, weight: float) -> None:
    """Count the ways of the targets across the play of gears from now on, see `problem.reversals`.

    Args:
        problem: Evaluated last at the curves of the input.
        play: Of the gears of all motors [rad or m], shape [M].
        weight: Of a squared way, over that of a squared error.
    """
    moving = np.eye(len(play))[:, play > 0.0]
    response = rigid_response(problem.model, problem.grid, problem.curves, problem.world, moving)
    levers = problem.objective.weights[..., None] * response.targets
    efforts = transmitted_by(problem.model, problem.run)
    terms = reversal_terms(play, efforts, problem.grid.h, problem.grid.judged, levers, weight)
    for robot in problem.robots:
        robot.count(terms)
