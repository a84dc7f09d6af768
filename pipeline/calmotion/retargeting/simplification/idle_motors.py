"""Motors that were left out of a search since they move no target: what they promise where it ended.

On a rigid robot they move none. On a flexible one they could still act by their inertia, as a counterweight does; the
gradient over their offsets, which the adjoint knows anyway, and two steps of conjugate gradients tell how much.
"""

from __future__ import annotations

import numpy as np

from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.shot import Character
from calmotion.shot.character import IntArray
from calmotion.simulation.inputs.gearing import coupling_of

STEPS = 2  # of conjugate gradients
ENOUGH = 0.05  # of the tolerance: what they must promise to be taken into the search after all


def idle_motors(character: Character) -> IntArray:
    """The motors that are left out though they may change."""
    return np.flatnonzero([m.optimize and m.idle and m.follows is None for m in character.motors]).astype(np.int32)


def idle_gain(problem: RetargetProblem, character: Character) -> float | None:
    """By how much the root-mean-square error would fall with the idle motors' help [m]; None where there are none.

    Args:
        problem: Linearised where its search ended; its state does not change.
    """
    motors = idle_motors(character)
    if not len(motors):
        return None
    other = problem.over_motors(motors, coupling_of(character, motors))
    residual = -other.gradient()
    way, square = residual, float(residual @ residual)
    found = 0.0
    for _ in range(STEPS):
        bent = other.product(way)
        curvature = float(way @ bent)
        if not (square > 0.0 and curvature > 0.0):
            break
        length = square / curvature
        found += 0.5 * length * square
        residual = residual - length * bent
        before, square = square, float(residual @ residual)
        way = residual + (square / before) * way
    return problem.gain(found, problem.objective_value())
