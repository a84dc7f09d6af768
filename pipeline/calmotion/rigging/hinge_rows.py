"""Serial hinges that perform given rotations: their axes and angles.

The rotations D(t) of a body relative to the previous one, the identity in the reference pose, are approximated by the
product exp(a_1 q_1) exp(a_2 q_2) ... of rotations about axes a_k, which are given in the reference pose.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from calmotion.shot.character import Array

_STEPS, _SMALL = 60, 1e-13
STILL = 1e-6  # largest rotation of a body that does not rotate [rad]
_STARTS = 6  # starting points of the search for the axes of two hinges


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
    for axes in _candidates(principal, D):
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


def _candidates(principal: Array, D: Array) -> Iterator[Array]:
    """Candidates for the axes, the fewest first."""
    yield principal[:1]
    yield _two(principal, D)
    # the middle hinge has the smallest angles: at a right angle there, the other two axes would be parallel
    for order in ((0, 2, 1), (1, 2, 0), (0, 1, 2)):
        yield principal[list(order)]


def _two(principal: Array, D: Array) -> Array:
    """Axes of the two hinges with the least residual.

    The angle between the axes is constant: a_1 . (D - I) a_2 = 0. This residual is divided by the sine of the angle
    between the axes, because it is small for any parallel ones. For small rotations both axes are in the plane of the
    rotation vectors, so the least-squares search starts from pairs in that plane.
    """
    W = D - np.eye(3)

    def residual(x: Array) -> Array:
        first, second = x.reshape(2, 3) / np.linalg.norm(x.reshape(2, 3), axis=1)[:, None]
        return np.asarray(np.einsum("i,nij,j->n", first, W, second) / np.linalg.norm(np.cross(first, second)))

    fits: list[Any] = []
    for angle in np.linspace(0.0, np.pi, _STARTS, endpoint=False):
        across = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) @ principal[:2]
        fits.append(least_squares(residual, across.ravel(), xtol=1e-12, ftol=1e-12, max_nfev=100))
    best = min(fits, key=lambda fit: float(fit.cost)).x.reshape(2, 3)
    return np.asarray(best / np.linalg.norm(best, axis=1)[:, None], dtype=np.float64)


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
    for _ in range(_STEPS):
        product = np.eye(3)
        columns = []
        for k, axis in enumerate(axes):
            columns.append(product @ axis)
            product = product @ _rotation(axis, q[k])
        J = np.array(columns).T
        step = np.linalg.solve(J.T @ J + 1e-9 * np.eye(len(axes)), J.T @ _vector(rotation @ product.T))
        q = q + step * min(1.0, 0.7 / max(float(np.max(np.abs(step))), 1e-300))
        if np.max(np.abs(step)) < _SMALL:
            break
    return q


def _rotation(axis: Array, angle: float) -> Array:
    """Rotation matrix about a unit axis (Rodrigues)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K))


def _vector(R: Array) -> Array:
    """Rotation vector of a rotation matrix; by SciPy near half a turn, where the short formula is singular."""
    skew = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine, cosine = float(np.linalg.norm(skew)), 0.5 * (float(np.trace(R)) - 1.0)
    if cosine < -0.99:
        return np.asarray(Rotation.from_matrix(R).as_rotvec(), dtype=np.float64)
    return skew * (np.arctan2(sine, cosine) / sine if sine > 1e-9 else 1.0)
