"""Motor curves as splines: the animator's curve and the optimiser's offset in one, exactly."""

import numpy as np
from pxr import Sdf, Ts

from calmotion.arrays import Array
from calmotion.model import Animation, Character, MotorCurve
from calmotion.model.curves import optimized_curve
from calmotion.usd.clock import Clock
from calmotion.usd.writing.curves import attribute_spec

SAME = 1e-9  # times that are closer are one [s]


def hermite(animation: Animation, curve: MotorCurve, cyclic: bool) -> tuple[Array, Array, Array, Array]:
    """A motor's curve as a cubic between knots: times [s], values [rad or m], and slopes before and after each, which
    differ at corners; shape [n] each.

    Knots are where the animation has samples and where the offset has knots; between them both are cubics.
    """
    track, end = animation.tracks[curve.motor], float(animation.frame_times[-1])
    whole = optimized_curve(animation, curve, cyclic)
    inner = track.times[(track.times > SAME) & (track.times < end - SAME)]
    times = np.unique(np.concatenate([[0.0, end], inner, curve.knots if curve.changed else []]))
    times = times[np.concatenate([[True], np.diff(times) > SAME])]
    after = whole(times, 1)
    corner = np.isclose(times[:, None], track.corners, rtol=0.0, atol=SAME).any(axis=1)
    before = np.where(corner, whole(times - 0.1 * SAME, 1), after)
    return times, whole(times, 0), before, after


def author_splines(
    layer: Sdf.Layer, character: Character, animation: Animation, curves: tuple[MotorCurve, ...], clock: Clock,
    meters: float,
) -> None:  # fmt: skip
    """Author each curve as an over with a spline, degrees or stage length; one of a shot that loops repeats itself.

    Args:
        curves: Those to write.
        meters: Metres in the stage's unit of length.
    """
    for curve in curves:
        motor, cyclic = character.motors[curve.motor], character.retarget.cyclic
        times, values, before, after = hermite(animation, curve, cyclic)
        unit = meters if motor.linear else np.deg2rad(1.0)
        slope = unit * clock.time_codes_per_second  # those of a spline are by time code
        spline = bezier(clock.time_codes(times), values / unit, before / slope, after / slope, "float")
        if cyclic:
            forever = Ts.Extrapolation(Ts.ExtrapLoopRepeat)
            spline.SetPreExtrapolation(forever)
            spline.SetPostExtrapolation(forever)
        attribute_spec(layer, f"{motor.prim_path}.{motor.attribute}", Sdf.ValueTypeNames.Float).SetSpline(spline)


def bezier(times: Array, values: Array, before: Array, after: Array, kind: str) -> Ts.Spline:
    """A Ts.Spline that is the cubic Hermite interpolant: tangents as long as a third of their interval.

    Args:
        times: Time codes, ascending, shape [n].
        values: Shape [n].
        before, after: Derivatives by time code on either side of each, shape [n].
        kind: Type of its values, that of the attribute.
    """
    spline, width = Ts.Spline(kind), np.diff(times) / 3.0
    spline.SetCurveType(Ts.CurveTypeBezier)
    for k in range(len(times)):
        knot = Ts.Knot(kind)
        knot.SetTime(float(times[k]))
        knot.SetValue(float(values[k]))
        knot.SetNextInterpolation(Ts.InterpCurve)
        if k > 0:
            knot.SetPreTanWidth(float(width[k - 1]))
            knot.SetPreTanSlope(float(before[k]))
        if k < len(times) - 1:
            knot.SetPostTanWidth(float(width[k]))
            knot.SetPostTanSlope(float(after[k]))
        spline.SetKnot(knot)
    return spline
