"""Motor inputs between instants, for integrators that evaluate them there."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from calmotion.arrays import Array

Drive = Callable[[Array], tuple[Array, Array, Array]]


def hermite_drive(times: Array, angles: Array, rates: Array) -> Drive:
    """Angles, rates and accelerations at any times from those at instants.

    Cubic from instant to instant, so that it is exact for cubic splines whose knots are instants.

    Args:
        times: [s], shape [T].
        angles, rates: Shape [T, J].

    Returns:
        A function of times, shape [k], to three arrays of shape [k, J].
    """
    curve = CubicHermiteSpline(times, angles, rates)
    derivatives = [curve, curve.derivative(), curve.derivative(2)]

    def drive(t: Array) -> tuple[Array, Array, Array]:
        first, second, third = (np.asarray(derivative(t)) for derivative in derivatives)
        return first, second, third

    return drive


def stage_inputs(drive: Drive, times: Array, shares: Array) -> Array:
    """Inputs at shares of every step, shape [T - 1, shares, 3, J]: angle, rate and acceleration.

    At the ends of a step, where accelerations may jump, the polynomial of that step is used.
    """
    h = np.diff(times)
    # slightly inside the step
    at = times[:-1, None] + h[:, None] * np.clip(shares, 1e-12, 1.0 - 1e-12)
    values = drive(at.ravel())
    return np.stack([v.reshape(*at.shape, v.shape[-1]) for v in values], axis=2)
