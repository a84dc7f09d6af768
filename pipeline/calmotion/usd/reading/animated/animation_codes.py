"""Time codes at which an attribute shows its animation, by time samples or by a spline."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from pxr import Ts, Usd

_BEYOND = 1.0  # time codes past the first and last knot of a spline that goes on there


def animation_codes(attribute: Usd.Attribute, parts: int = 3) -> list[float]:
    """Time codes of the samples of an attribute; of its spline where it has none: its knots, and points between them.

    USD does not count splines among time samples. Empty where nothing animates the attribute.

    Args:
        attribute: The Usd.Attribute.
        parts: Into which each interval between two knots is divided; with three, any curve between equal knots shows.
    """
    codes = list(attribute.GetTimeSamples())
    if codes or not attribute.HasSpline():
        return codes
    return _codes_of_spline(attribute.GetSpline(), parts)


def _codes_of_spline(spline: Ts.Spline, parts: int) -> list[float]:
    from pxr import Ts

    knots = np.array(list(spline.GetKnots().keys()), dtype=np.float64)
    if len(knots) == 0:
        return []
    shares = np.arange(parts) / parts
    codes = [*(knots[:-1, None] + np.diff(knots)[:, None] * shares).ravel(), knots[-1]]
    ends = ((spline.GetPreExtrapolation(), codes[0] - _BEYOND), (spline.GetPostExtrapolation(), codes[-1] + _BEYOND))
    codes += [code for extrapolation, code in ends if extrapolation.mode != Ts.ExtrapHeld]
    return [float(code) for code in sorted(codes)]
