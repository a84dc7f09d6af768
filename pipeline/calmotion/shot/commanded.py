"""Commanded values of the motors at any time: the curves of a result."""

from __future__ import annotations

import numpy as np

from calmotion.shot import Animation, Character, MotorCurve, Result, Track
from calmotion.shot.character import Array
from calmotion.shot.curves import Sample, curve_of


def optimized_curve(animation: Animation, curve: MotorCurve, cyclic: bool) -> Sample:
    """The curve of a motor in a result: the animator's curve, with its corners, plus the smooth offset."""
    end = float(animation.frame_times[-1])
    base = curve_of(animation.tracks[curve.motor], end, cyclic)
    if not curve.changed:
        return base
    # frames hold the offset exactly, as its knots lie on them
    offset = curve_of(Track(animation.frame_times, curve.frame_values - base(animation.frame_times, 0)), end, cyclic)
    return lambda times, order: base(times, order) + offset(times, order)


def commanded_values(character: Character, animation: Animation, result: Result, times: Array) -> Array:
    """Values of all motors [rad or m], shape [n, M]: the optimised curves, else what the shot carries.

    Args:
        times: [s] after the first frame, within the shot, shape [n].
    """
    end, cyclic = float(animation.frame_times[-1]), character.retarget.cyclic
    if result.curves:
        curves = [optimized_curve(animation, curve, cyclic) for curve in result.curves]
    else:
        curves = [curve_of(track, end, cyclic) for track in animation.current]
    columns = [curve(np.asarray(times, np.float64), 0) for curve in curves]
    return np.stack(columns, axis=1) if columns else np.zeros((len(times), 0))
