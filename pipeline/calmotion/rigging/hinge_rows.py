"""Hinges in a row that perform a rotation: which axes they need, and their angles.

Rotations D(t) of a body relative to the one before it, the identity in the pose in which the robot stands, are to be
the product exp(a_1 q_1) exp(a_2 q_2) ... of turns about axes a_k that are fixed in that pose.
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
STILL = 1e-6  # a rotation that stays below is none [rad]
_STARTS = 6  # of the search for the axes of two hinges


@dataclass(frozen=True, eq=False)
class HingeRow:
    """Hinges that perform rotations.

    Attributes:
        axes: Unit axes, shape [m, 3], from the base outwards; none for a body that does not turn.
        angles: [rad], shape [n, m].
        off: What is left of each rotation [rad], shape [n].
    """

    axes: Array
    angles: Array
    off: Array


def hinges_for(D: Array, tolerance: float) -> HingeRow:
    """The fewest hinges that perform rotations.

    Args:
        D: Rotations, neighbours less than half a turn apart, shape [n, 3, 3].
        tolerance: What may be left of each [rad].

    Returns:
        None, one or two hinges where that keeps the tolerance, else three at right angles, which perform all.
    """
    vectors = Rotation.from_matrix(D).as_rotvec()
    if np.max(np.linalg.norm(vectors, axis=1)) <= max(tolerance, STILL):
        return HingeRow(np.zeros((0, 3)), np.zeros((len(D), 0)), np.linalg.norm(vectors, axis=1))
    principal = _right_handed(np.linalg.svd(vectors, full_matrices=True)[2])
    best: HingeRow | None = None
    for axes in _candidates(principal, D):
        row = HingeRow(axes, *follow(axes, D))
        if best is None or row.off.max() < best.off.max():
            best = row
        if row.off.max() <= tolerance:
            return row
    assert best is not None
    return best


def _right_handed(axes: Array) -> Array:
    # the sign of an axis is arbitrary: the larger component points ahead, so that like joints get like axes
    signs = np.sign(axes[np.arange(3), np.argmax(np.abs(axes), axis=1)])
    return np.asarray(axes * signs[:, None], dtype=np.float64)


def _candidates(principal: Array, D: Array) -> Iterator[Array]:
    """Axes to try, the fewest first."""
    yield principal[:1]
    yield _two(principal, D)
    # the hinge in the middle is the one that turns least: a right angle there would lock the others
    for order in ((0, 2, 1), (1, 2, 0), (0, 1, 2)):
        yield principal[list(order)]


def _two(principal: Array, D: Array) -> Array:
    """Axes of two hinges that perform rotations best.

    The second axis keeps its angle to the first: a_1 . (D - I) a_2 = 0, over the sine of the angle between them, since
    it is small for any two that are parallel. For small turns both lie in the plane that the turns are about, so the
    search for the least squares starts from pairs in it.
    """
    W = D - np.eye(3)

    def off(x: Array) -> Array:
        first, second = x.reshape(2, 3) / np.linalg.norm(x.reshape(2, 3), axis=1)[:, None]
        return np.asarray(np.einsum("i,nij,j->n", first, W, second) / np.linalg.norm(np.cross(first, second)))

    found: list[Any] = []
    for angle in np.linspace(0.0, np.pi, _STARTS, endpoint=False):
        across = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) @ principal[:2]
        found.append(least_squares(off, across.ravel(), xtol=1e-12, ftol=1e-12, max_nfev=100))
    best = min(found, key=lambda fit: float(fit.cost)).x.reshape(2, 3)
    return np.asarray(best / np.linalg.norm(best, axis=1)[:, None], dtype=np.float64)


def follow(axes: Array, D: Array) -> tuple[Array, Array]:
    """Angles of hinges in a row whose product of rotations comes nearest to given ones.

    Args:
        axes: Unit axes, each in the axes of the first one's base with all angles zero, shape [m, 3], m up to 3.
        D: Rotations, neighbours less than half a turn apart, shape [n, 3, 3].

    Returns:
        Angles, unwrapped [rad], shape [n, m], and the angles of rotation that are left [rad], shape [n].
    """
    turns = Rotation.from_matrix(D)
    if len(axes) == 1:
        angles = about(axes[0], turns)[:, None]
    else:
        angles, q = np.zeros((len(D), len(axes))), _first(axes, D[0])
        for n in range(len(D)):
            q = _nearest(axes, D[n], q)
            angles[n] = q
    return angles, (_product(axes, angles).inv() * turns).magnitude()


def about(axis: Array, turns: Rotation) -> Array:
    """The part of rotations about a unit axis, unwrapped from within half a turn [rad], shape [n]."""
    quaternion = turns.as_quat(canonical=True)  # or else the first angle may be a whole turn off
    return np.unwrap(2.0 * np.arctan2(quaternion[:, :3] @ axis, quaternion[:, 3]))


def _product(axes: Array, angles: Array):
    turn = Rotation.identity(len(angles))
    for k, axis in enumerate(axes):
        turn = turn * Rotation.from_rotvec(angles[:, k, None] * axis)
    return turn


def _first(axes: Array, turn: Array) -> Array:
    """Angles for the first rotation: the smallest of those that Gauss-Newton finds from several starts."""
    starts = [np.zeros(len(axes)), *(s * 1.5 * e for e in np.eye(len(axes)) for s in (-1.0, 1.0))]
    found = [_nearest(axes, turn, start) for start in starts]
    left = [float((_product(axes, q[None]).inv() * Rotation.from_matrix(turn)).magnitude()[0]) for q in found]
    good = [k for k in range(len(found)) if left[k] < min(left) + 1e-6]
    return found[min(good, key=lambda k: float(np.abs(found[k]).max()))]


def _nearest(axes: Array, turn: Array, q: Array) -> Array:
    """Angles of the product nearest to a rotation matrix, by damped Gauss-Newton."""
    for _ in range(_STEPS):
        left = np.eye(3)
        columns = []
        for k, axis in enumerate(axes):
            columns.append(left @ axis)
            left = left @ _turned(axis, q[k])
        J = np.array(columns).T
        step = np.linalg.solve(J.T @ J + 1e-9 * np.eye(len(axes)), J.T @ _vector(turn @ left.T))
        q = q + step * min(1.0, 0.7 / max(float(np.max(np.abs(step))), 1e-300))
        if np.max(np.abs(step)) < _SMALL:
            break
    return q


def _turned(axis: Array, angle: float) -> Array:
    """Rotation matrix about a unit axis (Rodrigues)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def _vector(R: Array) -> Array:
    """Rotation vector of a rotation matrix; SciPy's near half a turn, where the short formula breaks down."""
    skew = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine, cosine = float(np.linalg.norm(skew)), 0.5 * (float(np.trace(R)) - 1.0)
    if cosine < -0.99:
        return np.asarray(Rotation.from_matrix(R).as_rotvec(), dtype=np.float64)
    return skew * (np.arctan2(sine, cosine) / sine if sine > 1e-9 else 1.0)
