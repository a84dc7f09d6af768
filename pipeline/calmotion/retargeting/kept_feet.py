"""The search with feet that ask of the ground only what it can do."""

from __future__ import annotations

from calmotion.retargeting.problem.ground import ground_bounds, ground_of
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.simulation.preparation import Prepared
from calmotion.simulation.standing.ground_limits import ground_limits


def keep_feet(prepared: Prepared, problem: RetargetProblem) -> None:
    """Limit from now on what the feet of each robot of a problem ask of the ground, where the shot has contacts.

    Args:
        problem: Evaluated last at the curves of the input.
    """
    bounds, curves = {}, (problem.curves.angles, problem.curves.rates)
    for k, robot in enumerate(problem.robots):
        robot.ground = ground_limits(
            prepared.character, robot.model, problem.grid, prepared.world, *curves, robot.run
        )  # fmt: skip
        if robot.ground is not None:
            bounds[ground_of(k)] = ground_bounds(robot.ground)
    if bounds:
        others = {} if problem.limits is None else problem.limits.bounds
        problem.limits = LimitTerms(others | bounds, problem.grid.judged, problem.grid.h, 1.0)
