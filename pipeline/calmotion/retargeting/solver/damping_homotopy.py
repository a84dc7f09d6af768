"""Damping homotopy: a start for inputs with large vibrations, from solutions with less and less damping.

Damping hardly affects the optimal curves, since these excite no vibration. It affects the search: about a motion that
vibrates with a large amplitude the linearisation is poor. Problems with strong damping need few products, and each
solution is the start of the next problem. The search of the soft linkage of `tests/retargeting/test_linkage.py` fails
without it; on the six samples and a KUKA it changes nothing.
"""

from contextlib import suppress
from dataclasses import replace

from calmotion.arrays import BoolArray
from calmotion.multibody.failure import SimulationFailure
from calmotion.retargeting.problem.problem import Evaluation
from calmotion.retargeting.solver.gauss_newton import Ends, Search, minimize

LARGE_ANGLE = 0.1  # error over the largest lever arm of a motor [rad] from which the homotopy is used
DAMPING_RATIOS = (0.2, 0.05)  # damping ratios of the lowest mode
STAGE_GAIN = 1e-3  # predicted gain that ends a stage, relative to the error at its start
STAGE_ITERATIONS = 5  # most iterations of a stage


def damping_homotopy(start: Evaluation, fixed: BoolArray, frequency: float) -> Search:
    """A search that begins at the given point, or at the result of the homotopy if the error there is large.

    Args:
        start: Where it begins.
        fixed: Unknowns that keep their values, shape [n].
        frequency: Lowest frequency of the character [Hz].
    """
    problem, best = start.problem, start
    evaluations = gradients = products = 0
    if start.error > LARGE_ANGLE * problem.lever() and frequency > 0.0:
        for ratio in DAMPING_RATIOS:
            damped = problem.damped(ratio, frequency)
            evaluations += 1
            with suppress(SimulationFailure):
                there = damped.at(best.x)
                begin, gain = Search.start(best.x, there), STAGE_GAIN * there.error
                stage = minimize(damped, begin, fixed, Ends(gain, STAGE_ITERATIONS))
                best = stage.at
                evaluations, gradients = evaluations + stage.evaluations, gradients + stage.gradients
                products += stage.products
        # a result that is no better, or cannot be simulated, is not used
        evaluations += 1
        reached = problem.tried(best.x)
        best = start if reached is None or not reached.merit < start.merit else reached
    return replace(Search.start(best.x, best), evaluations=evaluations, gradients=gradients, products=products)
