"""The motor curves of a point of a search."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_opening

from calmotion.arrays import Array
from calmotion.model import MotorCurve, Result
from calmotion.retargeting.problem.adaptive_knots import useful_knots
from calmotion.retargeting.problem.offset_basis import DEGREE
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.support import interrupts

UNCHANGED = 1e-5  # largest offset of a curve that counts as zero [rad]
NOTHING = 1e-6  # largest coefficients of a part of a curve that counts as zero: where errors have no weight [rad]


def found_curves(problem: RetargetProblem, motors: int, x: Array) -> tuple[tuple[MotorCurve, ...], Array]:
    """The curves of all motors, and the coefficients with negligible offsets set to exactly zero."""
    basis, grid = problem.space.basis, problem.grid
    coefficients = x.reshape(basis.count, len(problem.space.motors)).copy()
    coefficients[binary_opening(np.abs(coefficients) <= NOTHING, np.ones((DEGREE + 1, 1)))] = 0.0
    coefficients[:, np.max(np.abs(basis.values @ coefficients), axis=0) <= UNCHANGED] = 0.0
    by_motor = coefficients @ problem.space.coupling.T
    offsets = np.abs(basis.values @ by_motor)
    changes, largest = np.any(offsets > 0.0, axis=0), np.max(offsets[grid.judged], axis=0)
    curves = []
    for motor in range(motors):
        values, changed = problem.curves.angles[grid.frames, motor], bool(changes[motor])
        if changed:
            values = values + basis.at_frames @ by_motor[:, motor]
        knots = useful_knots(basis, by_motor[:, motor]) if changed else basis.knots[[0, -1]]
        curves.append(MotorCurve(motor, changed, knots, values, float(largest[motor])))
    return tuple(curves), coefficients.ravel()


def best_so_far(result: Result) -> Result:
    """The result of a search after which the user stopped the run; answers the interrupt."""
    interrupts.answer()
    return replace(result, search=replace(result.search, interrupted=True, stopped="interrupted"))
