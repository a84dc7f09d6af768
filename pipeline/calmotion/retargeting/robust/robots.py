"""The robots of scenarios in a retargeting problem."""

from __future__ import annotations

from collections.abc import Sequence

from calmotion.model.robust.robots import Scenario
from calmotion.model.run import RunSettings
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.problem.robot import Robot
from calmotion.retargeting.robust.scenarios import shot_of
from calmotion.simulation.preparation import Prepared, prepare
from calmotion.simulation.simulate import intended_motion
from calmotion.simulation.simulator import Simulator
from calmotion.simulation.target_errors import Objective


def robots_of(
    prepared: Prepared, problem: RetargetProblem, scenarios: Sequence[Scenario], options: RunSettings
) -> list[Robot]:
    """The robots of scenarios, the nominal one first, which perform the curves of a problem.

    Args:
        prepared: The shot of the problem.
        problem: For the nominal robot.
        scenarios: The robots.
        options: Of the run.
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
