"""Damping homotopy: a start for inputs with large vibrations, from solutions with less and less damping.

Damping hardly affects the optimal curves, since these excite no vibration. It affects the search: about a motion that
vibrates with a large amplitude the linearisation is poor. Problems with strong damping need few products, and each
solution is the start of the next problem.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.solver.gauss_newton import Search, minimize
from calmotion.retargeting.solver.recycling import Recycled

FAR = 0.1  # error over the largest lever arm of a motor [rad] from which the homotopy is used
DAMPING = (0.2, 0.05)  # damping ratios of the lowest mode
GAIN = 1e-3  # predicted gain that ends a stage, relative to the error at its start
STEPS = 5  # most iterations of a stage


def damping_homotopy(problem: RetargetProblem, start: Array, fixed: BoolArray, frequency: float) -> Search:
    """A search that begins at the given point, or at the result of the homotopy if the error there is large.

    Args:
        problem: Evaluated last at the start.
        start: Shape [n].
        fixed: Unknowns that keep their values, shape [n].
        frequency: Lowest frequency of the character [Hz].
    """
    evaluations = gradients = products = 0
    x = start
    if problem.error > FAR * problem.lever() and frequency > 0.0:
        for ratio in DAMPING:
            damped = problem.damped(ratio, frequency)
            if not np.isfinite(damped.value(x)):
                continue
            stage = minimize(damped, Search.start(x), fixed, GAIN * damped.error, max_iterations=STEPS)
            x = stage.x
            evaluations, gradients = evaluations + stage.evaluations + 1, gradients + stage.gradients
            products += stage.products
        # a result that is no better, or cannot be simulated, is not used
        reached, before = problem.value(x), problem.value(start)
        evaluations += 2
        x = x if reached < before else start
    return Search(x, np.inf, Recycled.none(len(x)), evaluations=evaluations, gradients=gradients, products=products)
