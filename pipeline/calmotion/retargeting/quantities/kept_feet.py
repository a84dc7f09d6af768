"""The search with feet that ask of the ground only what it can do."""

from dataclasses import replace

from calmotion.model.limits.bounds import Bounds
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.problem import Evaluation
from calmotion.retargeting.problem.robot import GROUND, of_robot
from calmotion.retargeting.quantities.ground import Ground, ground_bounds
from calmotion.simulation.preparation import Prepared
from calmotion.simulation.standing.ground_limits import ground_limits


def with_kept_feet(prepared: Prepared, at: Evaluation) -> Evaluation:
    """The curves of the input in a problem that also limits what the feet of each robot ask of the ground, where the
    shot has contacts.

    Args:
        at: At the curves of the input.
    """
    problem, bounds, robots = at.problem, dict[str, Bounds](), []
    curves = problem.curves.angles, problem.curves.rates
    for k, run in enumerate(at.runs):
        robot = run.robot
        found = ground_limits(prepared.character, robot.model, problem.grid, prepared.world, *curves, run.run)
        if found is not None:
            robot = replace(robot, limited={**robot.limited, GROUND: Ground(found, problem.grid.h)})
            bounds[of_robot(GROUND, k)] = ground_bounds(found)
        robots.append(robot)
    if not bounds:
        return at
    others = {} if problem.limits is None else problem.limits.bounds
    limits = LimitTerms.of(others | bounds, problem.grid.judged, problem.grid.h)
    return at.with_robots(replace(problem, robots=tuple(robots), limits=limits))
