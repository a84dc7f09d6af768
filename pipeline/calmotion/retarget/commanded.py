"""What the motors are told at any time: the curves of a result, for whoever plays them."""

from __future__ import annotations

import numpy as np

from ..shot import Animation, Character, Result, Track
from ..shot.character import Array
from .curves import curve_of


def commanded_values(character: Character, animation: Animation, result: Result, times: Array) -> Array:
    """Values of all motors [rad or m], shape [n, M]: the optimised curves, else what the shot carries.

    Args:
        times: [s] after the first frame, within the shot, shape [n].
    """
    end, cyclic = float(animation.frame_times[-1]), character.retarget.cyclic
    tracks = [Track(animation.frame_times, curve.frame_values) for curve in result.curves] or animation.current
    columns = [curve_of(track, end, cyclic)(np.asarray(times, np.float64), 0) for track in tracks]
    return np.stack(columns, axis=1) if columns else np.zeros((len(times), 0))
