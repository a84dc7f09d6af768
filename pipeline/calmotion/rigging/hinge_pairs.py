"""The axes of two serial hinges that perform given rotations best."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import least_squares

from calmotion.arrays import Array

_STARTS = 6  # starting points of the search


def hinge_pair(principal: Array, D: Array) -> Array:
    """Axes of the two hinges with the least residual.

    The angle between the axes is constant: a_1 . (D - I) a_2 = 0. This residual is divided by the sine of the angle
    between the axes, because it is small for any parallel ones. For small rotations both axes are in the plane of the
    rotation vectors, so the least-squares search starts from pairs in that plane.

    Args:
        principal: Principal directions of the rotation vectors, the largest first, shape [3, 3].
        D: Rotations, shape [n, 3, 3].

    Returns:
        Unit axes, shape [2, 3].
    """
    # the residuals are linear in D: up to nine combinations of all instants have the same sum of squares
    W = np.asarray(np.linalg.qr((D - np.eye(3)).reshape(-1, 9), mode="r")).reshape(-1, 3, 3)
    fits: list[Any] = []
    for angle in np.linspace(0.0, np.pi, _STARTS, endpoint=False):
        across = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) @ principal[:2]
        fits.append(
            least_squares(residuals, across.ravel(), derivatives, args=(W,), xtol=1e-12, ftol=1e-12, max_nfev=100)
        )
    return _units(min(fits, key=lambda fit: float(fit.cost)).x)[0]


def least_residual(pair: Array, D: Array) -> float:
    """What the largest residual angle is at least [rad]: a rotation by an angle moves an axis by no more than it.

    Args:
        pair: Unit axes, shape [2, 3].
        D: Rotations, shape [n, 3, 3].
    """
    return float(np.abs((D - np.eye(3)) @ pair[1] @ pair[0]).max())


def residuals(x: Array, W: Array) -> Array:
    """a_1 . W a_2 over the sine of the angle between two axes, shape [n].

    Args:
        x: The axes a_1 and a_2, of any length, shape [6].
        W: Rotations less the identity, or combinations of them, shape [n, 3, 3].
    """
    (first, second), _ = _units(x)
    across: Array = (W @ second) @ first / np.linalg.norm(second - (first @ second) * first)
    return across


def derivatives(x: Array, W: Array) -> Array:
    """Those of the residuals by x, shape [n, 6]; arguments as of `residuals`."""
    (first, second), lengths = _units(x)
    cosine = first @ second
    sine = np.linalg.norm(second - cosine * first)
    by_second = W @ second
    of_sine = cosine / sine**2 * (by_second @ first)[:, None]
    by_axes = ((by_second + of_sine * second) / sine, (first @ W + of_sine * first) / sine)
    # the length of an axis does not count
    sides = [
        (by_axis - (by_axis @ axis)[:, None] * axis) / length
        for by_axis, axis, length in zip(by_axes, (first, second), lengths, strict=True)
    ]
    return np.hstack(sides)


def _units(x: Array) -> tuple[Array, Array]:
    """Unit axes, shape [2, 3], and their lengths, shape [2]."""
    axes = x.reshape(2, 3)
    lengths = np.sqrt(np.sum(axes**2, axis=1))
    return axes / lengths[:, None], lengths
