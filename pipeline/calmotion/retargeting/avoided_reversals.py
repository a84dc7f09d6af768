"""The search with the play of gears in its objective (`optimize --avoid-reversals`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Character
from calmotion.model.run import RunSettings
from calmotion.retargeting.problem.posing import refuse_continuous
from calmotion.retargeting.problem.problem import Evaluation
from calmotion.retargeting.problem.rigid_robot import RigidRobot
from calmotion.retargeting.quantities.gear_play import gear_play, transmitted_by

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
    refuse_continuous(options, character, OPTION)


def play_of(character: Character) -> Array:
    """Play of the gears of all motors [rad or m], shape [M]."""
    return np.array([motor.backlash for motor in character.motors], float)


def with_reversals(at: Evaluation, play: Array, weight: float) -> Evaluation:
    """The curves of the input in a problem that also counts the ways of the targets across the play of gears, see
    `quantities.gear_play`.

    Args:
        at: At the curves of the input.
        play: Of the gears of all motors [rad or m], shape [M].
        weight: Of a squared way, over that of a squared error.
    """
    problem = at.problem
    moving = np.eye(len(play))[:, play > 0.0]
    response = RigidRobot(problem.model, problem.grid, problem.curves, problem.world, moving).response
    levers = problem.objective.weights[..., None] * response.targets
    efforts = transmitted_by(problem.model, at.run)
    terms = gear_play(problem.model, play, efforts, problem.grid.h, problem.grid.judged, levers, weight)
    robots = (replace(robot, residuals=(replace(terms, model=robot.model),)) for robot in problem.robots)
    return at.with_robots(replace(problem, robots=tuple(robots)))
