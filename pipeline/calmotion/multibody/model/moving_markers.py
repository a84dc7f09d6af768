"""Markers of the world with a prescribed motion: the moving roots of characters.

A marker at an instant is a row of 18 numbers: position [m], velocity [m/s], angular velocity in marker axes
[rad/s], rotation matrix by rows.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array
from calmotion.multibody.kernels.markers import WORLD_MARKER


def pack(positions: Array, velocities: Array, spins: Array, matrices: Array) -> Array:
    """Rows of markers from position, velocity, angular velocity, shape [..., 3] each, and matrices, [..., 3, 3]."""
    out = np.zeros(positions.shape[:-1] + (WORLD_MARKER,))
    out[..., :3], out[..., 3:6], out[..., 6:9] = positions, velocities, spins
    out[..., 9:] = matrices.reshape(matrices.shape[:-2] + (9,))
    return out


def rooted(world: Array | None, total: int) -> Array:
    """Moving markers at all instants, shape [T, W, 18]; empty where none are given."""
    return np.zeros((total, 0, WORLD_MARKER)) if world is None else world


def between(world: Array, h: float, share: float) -> Array:
    """Markers at a fraction of a step h [s] from its two instants, shape [2, W, 18]; cubic in position and rotation
    vector. Contacts that do not hold at both instants are as the second one has them, for the whole step."""
    found: Array = world[1].copy()
    there = np.all(np.any(world[..., 9:] != 0.0, axis=-1), axis=0)
    if np.any(there):
        found[there] = _interpolated(world[:, there], h, share)
    return found


def _interpolated(world: Array, h: float, share: float) -> Array:
    """`between` of markers that are there at both instants."""
    first, last = world
    start, end = (Rotation.from_matrix(rows[:, 9:].reshape(-1, 3, 3)) for rows in (first, last))
    turn = (start.inv() * end).as_rotvec()
    # the rotation vector's rate at both ends: omega = J_r theta', and J_r theta = theta
    rates = np.stack([first[:, 6:9], np.linalg.solve(_right_jacobian(turn), last[:, 6:9, None])[..., 0]])
    s = share
    h00, h10, h01, h11 = 1 - 3 * s**2 + 2 * s**3, s - 2 * s**2 + s**3, 3 * s**2 - 2 * s**3, s**3 - s**2
    d00, d10, d01, d11 = (-6 * s + 6 * s**2) / h, 1 - 4 * s + 3 * s**2, (6 * s - 6 * s**2) / h, 3 * s**2 - 2 * s
    position = h00 * first[:, :3] + h * h10 * first[:, 3:6] + h01 * last[:, :3] + h * h11 * last[:, 3:6]
    velocity = d00 * first[:, :3] + d10 * first[:, 3:6] + d01 * last[:, :3] + d11 * last[:, 3:6]
    theta = h * h10 * rates[0] + h01 * turn + h * h11 * rates[1]
    slope = d10 * rates[0] + d01 * turn + d11 * rates[1]
    spin = (_right_jacobian(theta) @ slope[..., None])[..., 0]
    return pack(position, velocity, spin, (start * Rotation.from_rotvec(theta)).as_matrix())


def _right_jacobian(theta: Array) -> Array:
    """J_r of rotation vectors, shape [n, 3] to [n, 3, 3]."""
    from calmotion.multibody.kernels.so3 import right_jacobian

    out = np.zeros((len(theta), 3, 3))
    for vector, J in zip(theta, out, strict=True):
        right_jacobian(vector, J)
    return out
