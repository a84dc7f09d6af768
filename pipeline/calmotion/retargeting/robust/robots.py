"""The robots for which curves are optimised, and their places in a retargeting problem."""

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Track
from calmotion.model.run import RunSettings
from calmotion.model.uncertainty import Scenario
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.problem.robot import Robot
from calmotion.retargeting.robust.measure import errors_on
from calmotion.retargeting.robust.scenarios import Parameter, scenario_at, shot_of
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.preparation import Prepared, prepare
from calmotion.simulation.simulate import intended_motion
from calmotion.simulation.simulator import Simulator
from calmotion.simulation.target_errors import Objective

COUNT = 48
STRETCH = 1.25  # so that the farthest of these are as far as those of 200
SEED = 20190705
ALIKE = 0.5  # least distance of two that are taken, over their own


def random_points(parameters: Sequence[Parameter]) -> Array:
    """Random robots, some of which a search takes; curves are measured on others. In standard deviations, [n, d]."""
    return STRETCH * np.random.default_rng(SEED).standard_normal((COUNT, len(parameters)))


def opposite_pairs(parameters: Sequence[Parameter], count: int) -> tuple[Scenario, ...]:
    """The nominal robot, and pairs of random ones on opposite sides of it, all of equal weights."""
    points = random_points(parameters)[: (count - 1) // 2] / STRETCH
    every = np.concatenate([np.zeros((1, len(parameters))), points, -points])
    return tuple(scenario_at(parameters, x, 1.0 / len(every)) for x in every)


def farthest(
    shot: CompiledShot, options: RunSettings, tracks: Sequence[Track], parameters: Sequence[Parameter], count: int,
    above: float = 0.0,
) -> tuple[Scenario, ...]:  # fmt: skip
    """Random robots with the largest errors, which are not alike, and perform the animation as well.

    Args:
        tracks: Curves.
        count: Number of robots.
        above: Weighted error that they have at least [m].
    """
    points = random_points(parameters)
    tried = [scenario_at(parameters, x) for x in points]
    found = errors_on(shot, options, {"": tracks}, tried, weighted=True)[""].max(axis=(1, 2))
    found = np.where(np.isfinite(found), found, 0.0)
    picked: list[int] = []
    for k in np.argsort(-found):
        near = (np.linalg.norm(points[k] - points[j]) <= ALIKE * np.linalg.norm(points[j]) for j in picked)
        if len(picked) < count and found[k] > above and not any(near):
            picked.append(int(k))
    taken = [tried[k] for k in picked]
    animated = errors_on(shot, options, {"": shot.animation.tracks}, taken)[""]
    return tuple(one for one, off in zip(taken, animated, strict=True) if np.isfinite(off).all())


def robots_of(
    prepared: Prepared, problem: RetargetProblem, scenarios: Sequence[Scenario], options: RunSettings
) -> list[Robot]:
    """The robots of scenarios, the nominal one first, which perform the curves of a problem.

    Args:
        problem: For the nominal robot.
    """
    return [_robot(prepared, problem, scenario, options) for scenario in scenarios]


def _robot(prepared: Prepared, problem: RetargetProblem, scenario: Scenario, options: RunSettings) -> Robot:
    """The robot of a scenario, with its own static sag where that is what is intended."""
    simulator, objective = problem.robots[0].simulator, problem.objective
    if scenario.factors:
        other = prepare(shot_of(prepared.shot, scenario), options)
        intended = intended_motion(other, problem.curves.angles, problem.curves.rates)
        objective = Objective.over(other.model, intended, other.grid, prepared.shot.animation.weights)
        simulator = Simulator(other.model, other.grid.h, other.world, other.grid.cyclic)
    return Robot(simulator, objective, scenario.weight)
