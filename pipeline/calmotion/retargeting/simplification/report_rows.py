"""The rows of the report about the simplifications of a search: knots, motors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calmotion.model import Character, MotorCurve, Simplification
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.simplification.idle_motors import idle_motors

FINER = 0.1  # share of the least gain of a search that finer knots must gain
PRUNED = 0.2  # share of it that the removed offsets may cost together


def search_rows(
    problem: RetargetProblem, character: Character, curves: Sequence[MotorCurve], options: RunSettings,
    idle_gain_m: float | None,
) -> list[Simplification]:  # fmt: skip
    """The rows of a search that ended.

    Args:
        problem: On the final knots.
        idle_gain_m: Gain that idle motors would bring [m]; None where there are none.
    """
    tolerance = tolerance_of(character, options.tolerance)
    pruned = PRUNED * options.least_gain
    idle = idle_motors(character)
    rows = [_knots_row(problem, character, options)]
    rows += [
        Simplification(
            character.motors[k].path + ": not optimised", "it moves no target; the error is its possible gain", gain
        )
        for k, gain in zip(idle, [idle_gain_m, *[None] * len(idle)], strict=False)
    ]
    rows += [
        Simplification(
            character.motors[curve.motor].path + ": curve unchanged",
            f"a change would gain less than {100.0 * pruned:.3g}% of the tolerance",
            pruned * tolerance,
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
