"""Serial hinges that perform given rotations: their axes and angles.

The rotations D(t) of a body relative to the previous one, the identity in the reference pose, are approximated by the
product exp(a_1 q_1) exp(a_2 q_2) ... of rotations about axes a_k, which are given in the reference pose.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array

_STEPS, _SMALL = 60, 1e-13
STILL = 1e-6  # largest rotation of a body that does not rotate [rad]


@dataclass(frozen=True, eq=False)
class HingeRow:
    """Serial hinges and their angles.

    Attributes:
        axes: Unit axes from the base outwards, shape [m, 3]; m = 0 for a body that does not rotate.
        angles: [rad], shape [n, m].
        residual: Residual angle of each rotation [rad], shape [n].
    """

    axes: Array
    angles: Array
    residual: Array


def hinges_for(D: Array, tolerance: float) -> HingeRow:
    """The fewest hinges that perform rotations within a tolerance.

    Args:
        D: Rotations, neighbours less than half a turn apart, shape [n, 3, 3].
        tolerance: Largest residual angle [rad].

    Returns:
        No, one or two hinges where these keep the tolerance, else three at right angles, which perform any rotation.
    """
    vectors = Rotation.from_matrix(D).as_rotvec()
    if np.max(np.linalg.norm(vectors, axis=1)) <= max(tolerance, STILL):
        return HingeRow(np.zeros((0, 3)), np.zeros((len(D), 0)), np.linalg.norm(vectors, axis=1))
    principal = _right_handed(np.linalg.svd(vectors, full_matrices=True)[2])
    best: HingeRow | None = None
    for axes in _candidates(principal, D, tolerance):
        row = HingeRow(axes, *follow(axes, D))
        if best is None or row.residual.max() < best.residual.max():
            best = row
        if row.residual.max() <= tolerance:
            return row
    assert best is not None
    return best


def _right_handed(axes: Array) -> Array:
    # the sign of an axis is arbitrary: its largest component is positive, so similar joints have similar axes
    signs = np.sign(axes[np.arange(3), np.argmax(np.abs(axes), axis=1)])
    return np.asarray(axes * signs[:, None], dtype=np.float64)


def _candidates(principal: Array, D: Array, tolerance: float) -> Iterator[Array]:
    """Candidates for the axes, the fewest first; two that cannot keep the tolerance come last, as the best of all they
    may be all the same."""
    yield principal[:1]
    pair = hinge_pair(principal, D)
    keeps = least_residual(pair, D) <= tolerance
    if keeps:
        yield pair
    # the middle hinge has the smallest angles: at a right angle there, the other two axes would be parallel
    for order in ((0, 2, 1), (1, 2, 0), (0, 1, 2)):
        yield principal[list(order)]
    if not keeps:
        yield pair


def follow(axes: Array, D: Array) -> tuple[Array, Array]:
    """Angles of serial hinges whose product of rotations is nearest to given ones.

    Args:
        axes: Unit axes in the frame of the base at zero angles, shape [m, 3], m up to 3.
        D: Rotations, neighbours less than half a turn apart, shape [n, 3, 3].

    Returns:
        Angles, unwrapped [rad], shape [n, m], and residual angles [rad], shape [n].
    """
    rotations = Rotation.from_matrix(D)
    if len(axes) == 1:
        angles = about(axes[0], rotations)[:, None]
    else:
        angles, q = np.zeros((len(D), len(axes))), _first(axes, D[0])
        for n in range(len(D)):
            q = _nearest(axes, D[n], q)
            angles[n] = q
    return angles, (_product(axes, angles).inv() * rotations).magnitude()


def about(axis: Array, rotations: Rotation) -> Array:
    """Angles of the twist of rotations about a unit axis, unwrapped, the first within half a turn [rad], shape [n]."""
    quaternion = rotations.as_quat(canonical=True)  # otherwise the first angle may be wrong by a whole turn
    return np.unwrap(2.0 * np.arctan2(quaternion[:, :3] @ axis, quaternion[:, 3]))


def _product(axes: Array, angles: Array) -> Rotation:
    product = Rotation.identity(len(angles))
    for k, axis in enumerate(axes):
        product = product * Rotation.from_rotvec(angles[:, k, None] * axis)
    return product


def _first(axes: Array, rotation: Array) -> Array:
    """Angles for the first rotation: the smallest solution of Gauss-Newton from several starting points."""
    starts = [np.zeros(len(axes)), *(s * 1.5 * e for e in np.eye(len(axes)) for s in (-1.0, 1.0))]
    solutions = [_nearest(axes, rotation, start) for start in starts]
    residuals = [
        float((_product(axes, q[None]).inv() * Rotation.from_matrix(rotation)).magnitude()[0]) for q in solutions
    ]
    good = [q for q, residual in zip(solutions, residuals, strict=True) if residual < min(residuals) + 1e-6]
    return min(good, key=lambda q: float(np.abs(q).max()))


def _nearest(axes: Array, rotation: Array, q: Array) -> Array:
    """Angles of the product nearest to a rotation matrix, by damped Gauss-Newton."""
    across, damping = _cross_matrices(axes), 1e-9 * np.eye(len(axes))
    twice = across @ across
    J = np.zeros((3, len(axes)))
    for _ in range(_STEPS):
        turns = np.eye(3) + np.sin(q)[:, None, None] * across + (1.0 - np.cos(q))[:, None, None] * twice  # Rodrigues
        product = np.eye(3)
        for k, turn in enumerate(turns):
            J[:, k] = product @ axes[k]
            product = product @ turn
        step = np.linalg.solve(J.T @ J + damping, J.T @ _vector(rotation @ product.T))
        largest = float(np.abs(step).max())
        q = q + step * min(1.0, 0.7 / max(largest, 1e-300))
        if largest < _SMALL:
            break
    return q


def _cross_matrices(axes: Array) -> Array:
    """The matrices of cross products with axes, shape [m, 3, 3]."""
    return np.asarray(np.cross(axes[:, None], np.eye(3)).swapaxes(1, 2))


def _vector(R: Array) -> Array:
    """Rotation vector of a rotation matrix; by SciPy near half a turn, where the short formula is singular."""
    skew = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine, cosine = math.sqrt(skew @ skew), 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0)
    if cosine < -0.99:
        return np.asarray(Rotation.from_matrix(R).as_rotvec(), dtype=np.float64)
    return skew * (math.atan2(sine, cosine) / sine if sine > 1e-9 else 1.0)


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
