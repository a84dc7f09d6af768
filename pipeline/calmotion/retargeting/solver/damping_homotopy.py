"""A good start where the input shakes wildly: the same problem on a robot that is damped more and more lightly.

The curves that are sought do not excite vibration, so damping hardly matters to them; but about a motion that shakes
by a large angle the linearised robot says little of the real one. Solutions with strong damping take few products,
and each is a start for the next.
"""

from __future__ import annotations

import numpy as np

from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.solver.gauss_newton import Search, minimize
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.shot.character import Array, BoolArray

FAR = 0.1  # error over the lever of the motor that moves targets most [rad], from which on it is worth it
DAMPING = (0.2, 0.05)  # of the lowest mode, ratios of critical
GAIN = 1e-3  # that ends a stage, over the error at its start
STEPS = 5  # of a stage at most


def damping_homotopy(problem: RetargetProblem, start: Array, fixed: BoolArray, frequency: float) -> Search:
    """A search that begins at the given point, or near the optimum where that is far.

    Args:
        problem: Evaluated last at the start.
        frequency: The lowest one of the character [Hz].
    """
    evaluations = gradients = products = 0
    x = start
    if problem.error > FAR * problem.lever() and frequency > 0.0:
        for ratio in DAMPING:
            damped = problem.damped(ratio, frequency)
            if not np.isfinite(damped.value(x)):
                continue
            found = minimize(damped, Search.start(x), fixed, GAIN * damped.error, max_iterations=STEPS)
            x = found.x
            evaluations, gradients = evaluations + found.evaluations + 1, gradients + found.gradients
            products += found.products
        # a start that is no better, or cannot be simulated, was no start
        reached, before = problem.value(x), problem.value(start)
        evaluations += 2
        x = x if reached < before else start
    return Search(x, np.inf, Recycled.none(len(x)), (), evaluations, gradients, products)
