"""What a search leaves out: motors that do nothing, and how a report tells it."""

from collections.abc import Callable, Sequence

import numpy as np

from calmotion.arrays import BoolArray, IntArray
from calmotion.model import Character, MotorCurve, Simplification
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.retargeting.problem.adaptive_knots import halved
from calmotion.retargeting.problem.linear_problem import LinearProblem
from calmotion.retargeting.problem.offset_basis import OffsetBasis
from calmotion.retargeting.problem.problem import Evaluation, RetargetProblem
from calmotion.simulation.inputs.curves import coupling_of
from calmotion.simulation.inputs.time_grid import TimeGrid

FixedOn = Callable[[OffsetBasis], BoolArray]


def first_change(grid: TimeGrid, basis: OffsetBasis, fixed_on: FixedOn) -> int:
    """Index of an instant before which only fixed coefficients act, on these knots and on the next finer ones.

    Args:
        fixed_on: Maps a basis to its fixed coefficients, shape [n], bool.
    """

    def start_on(on: OffsetBasis) -> float:
        free = ~np.all(fixed_on(on).reshape(on.count, -1), axis=1)
        return float(np.min(on.support[free, 0], initial=grid.end))

    start = 0.0 if grid.cyclic else start_on(basis)
    if start > 0.0:
        start = min(start, start_on(basis.on(grid, halved(grid, basis.breaks))))
    if not start > 0.0:
        return 0
    return min(int(np.searchsorted(grid.times, start - 0.5 * grid.h)), len(grid.times) - 2)


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
    return at.gain(decrease)


FINER = 0.1  # share of the least gain of a search that finer knots must gain


def search_rows(
    problem: RetargetProblem,
    character: Character,
    curves: Sequence[MotorCurve],
    options: RunSettings,
    idle_gain_m: float | None,
) -> list[Simplification]:
    """The rows of a search that ended.

    Args:
        problem: On the final knots.
        idle_gain_m: Gain that idle motors would bring [m]; None where there are none.
    """
    idle = idle_motors(character)
    rows = [_knots_row(problem, character, options)]
    rows += [
        Simplification(
            character.motors[k].path + ": not optimised", "it could reduce errors by no more than the estimate", gain
        )
        for k, gain in zip(idle, [idle_gain_m, *[None] * len(idle)], strict=False)
    ]
    rows += [
        Simplification(
            character.motors[curve.motor].path + ": curve unchanged",
            "no offset of it above a hundredth of a milliradian reduces the errors",
        )
        for curve in curves
        if not curve.changed and curve.motor in problem.space.motors
    ]
    return rows


def _knots_row(problem: RetargetProblem, character: Character, options: RunSettings) -> Simplification:
    """The closest distance of knots, and its reason."""
    closest = float(np.diff(problem.space.basis.knots).min())
    what = f"knots at least {1e3 * closest:.3g} ms apart"
    if options.knot_spacing:
        return Simplification(what, "given by retarget.optimize.knot_spacing")
    if character.retarget.knot_spacing:
        return Simplification(what, "given by calm:retarget:knotSpacing")
    tolerance = tolerance_of(character, options.tolerance)
    finer = FINER * options.least_gain
    why = f"finer knots would gain less than {100.0 * finer:.3g}% of the tolerance"
    return Simplification(what, why, finer * tolerance)
