"""Cost of a limit: the decrease of the error that it prevents, estimated by one Gauss-Newton step without it."""

import numpy as np

from calmotion.arrays import BoolArray
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.retargeting.problem.problem import Evaluation
from calmotion.retargeting.solver.limited_step import limited_step

ESTIMATED_LIMITS = 4  # number of limits whose cost is estimated, largest multipliers first
STEP_PRODUCTS, STEP_SHARE = 30, 0.05  # most products of a step, and share of the decrease that it may leave


def limit_costs(at: Evaluation, fixed: BoolArray) -> dict[tuple[int, str], float]:
    """Decrease of the root-mean-square error that each binding limit prevents [m], by motor and quantity.

    Args:
        at: Where the search ended.
        fixed: Unknowns that keep their values.
    """
    limits = at.problem.limits
    if limits is None:
        return {}
    weights = {
        (motor, name): float(np.sum(np.abs(limits.gradient(name, values)[:, motor])) * limits.bounds[name].scale[motor])
        for name, values in at.limited.items()
        if name in kinds_of_limits()
        for motor in range(values.shape[1])
        if limits.binds(motor, name, values)
    }
    if not weights:
        return {}
    costs = {}
    for motor, name in sorted(weights, key=lambda key: -weights[key])[:ESTIMATED_LIMITS]:
        without = at.with_limits(limits.without(motor, name))
        step = limited_step(without.linearized(), fixed, STEP_SHARE, 0.0, STEP_PRODUCTS)
        costs[motor, name] = max(0.0, at.gain(step.eased))
    return costs
