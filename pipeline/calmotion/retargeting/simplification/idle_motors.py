"""Idle motors: motors that move no target of a rigid robot and are not part of the search.

On a flexible robot they could still act through their inertia, as a counterweight does. The adjoint gives the gradient
with respect to their offsets without further simulation, and two steps of conjugate gradients estimate the gain.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import IntArray
from calmotion.model import Character
from calmotion.retargeting.problem.linear_problem import LinearProblem
from calmotion.retargeting.problem.problem import Evaluation
from calmotion.simulation.inputs.gearing import coupling_of

CG_STEPS = 2  # of conjugate gradients
JOINING_GAIN = 0.05  # share of the tolerance: idle motors with a larger gain join the search


def idle_motors(character: Character) -> IntArray:
    """Indices of the motors that may change but are idle."""
    return np.flatnonzero([m.optimize and m.idle and m.follows is None for m in character.motors]).astype(np.int32)


def idle_gain(at: Evaluation, linear: LinearProblem, character: Character) -> float | None:
    """Decrease of the root-mean-square error that the idle motors would bring [m]; None where there are none.

    Args:
        at, linear: Where the search ended, and the problem linearised there.
    """
    motors = idle_motors(character)
    if not len(motors):
        return None
    over = at.problem.over_motors(motors, coupling_of(character, motors))
    other = linear.over(over.space, np.zeros(over.size), over.rigid)
    residual = -other.gradient
    direction, square = residual, float(residual @ residual)
    decrease = 0.0
    for _ in range(CG_STEPS):
        product = other.product(direction)
        curvature = float(direction @ product)
        if not (square > 0.0 and curvature > 0.0):
            break
        length = square / curvature
        decrease += 0.5 * length * square
        residual = residual - length * product
        before, square = square, float(residual @ residual)
        direction = residual + (square / before) * direction
    return at.gain(decrease, at.objective_value)
