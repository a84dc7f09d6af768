"""What a limit costs: how far the error would fall without it, by one Gauss-Newton step."""

from __future__ import annotations

import numpy as np

from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.solver.limited_step import limited_step
from calmotion.shot.character import BoolArray

MOST = 4  # limits whose cost is worked out, those with the largest multipliers first
PRODUCTS, SHARE = 30, 0.05


def limit_costs(problem: RetargetProblem, fixed: BoolArray) -> dict[tuple[int, str], float]:
    """Fall of the root-mean-square error that each binding limit prevents [m], by motor and quantity.

    Args:
        problem: Evaluated last where the search ended.
        fixed: Unknowns that keep their values.
    """
    limits = problem.limits
    if limits is None:
        return {}
    weights = {
        (motor, name): float(np.sum(np.abs(limits.gradient(name, values)[:, motor])) * limits.bounds[name].scale[motor])
        for name, values in problem.limited.items()
        for motor in range(values.shape[1])
        if limits.binds(motor, name, values)
    }
    if not weights:
        return {}
    problem.linearize()
    costs = {}
    try:
        for motor, name in sorted(weights, key=lambda key: -weights[key])[:MOST]:
            problem.limits = limits.without(motor, name)
            step = limited_step(problem, fixed, SHARE, 0.0, PRODUCTS)
            costs[motor, name] = max(0.0, problem.gain(step.eased, problem.objective_value()))
    finally:
        problem.limits = limits
    return costs
