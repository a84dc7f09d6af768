"""Skeletons whose joints all have parallel axes in their rest pose, as BVH files have them, y up.

The rest pose is that of the first frame as the shot authors it; angles of a file count from there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from scipy.spatial.transform import Rotation

from .body_poses import BodyTree, LocalPoses, motor_values

EULER_ORDERS = ("ZXY", "ZYX", "YXZ", "YZX", "XYZ", "XZY")


@dataclass(frozen=True, eq=False)
class ParallelSkeleton:
    """Where joints lie at rest, and how its axes follow from those of bodies.

    Attributes:
        bodies: The bodies.
        upward: Rotates axes of the world so that y is up.
        axes: Rotation of each body at rest, y up, B of them.
    """

    bodies: BodyTree
    upward: Rotation
    axes: tuple[Rotation, ...]

    def of(self, poses: LocalPoses) -> tuple[Array, list[Rotation]]:
        """Translations [m], shape [T, B, 3], and rotations of the joints from rest, in parallel axes."""
        translations, rotations = np.empty_like(poses.translations), []
        for k, parent in enumerate(self.bodies.tree.parent):
            before = self.upward if parent < 0 else self.axes[parent]
            translations[:, k] = before.apply(poses.translations[:, k])
            rotations.append(before * _turn(poses.rotations[:, k]) * self.axes[k].inv())
        return translations, rotations

    def local(self, times: Array, translations: Array, rotations: list[Rotation]) -> LocalPoses:
        """The poses of bodies of such translations and rotations."""
        moved, turned = np.empty_like(translations), np.empty((*translations.shape[:2], 4))
        for k, parent in enumerate(self.bodies.tree.parent):
            before = self.upward if parent < 0 else self.axes[parent]
            moved[:, k] = before.inv().apply(translations[:, k])
            turned[:, k] = np.roll((before.inv() * rotations[k] * self.axes[k]).as_quat(), 1, axis=-1)
        return LocalPoses(times, moved, turned)

    def tip(self, component: int, point: Array) -> Array:
        """A point of a body [m] from its joint, at rest, shape [3]."""
        return np.asarray(self.axes[component].apply(point - self.bodies.pivots[component]))


def parallel_skeleton(bodies: BodyTree) -> ParallelSkeleton:
    """The skeleton of a character."""
    gravity = bodies.character.gravity
    up = -gravity / np.linalg.norm(gravity) if np.any(gravity) else np.array([0.0, 0.0, 1.0])
    upward = _onto_y(up)
    return ParallelSkeleton(bodies, upward, tuple(upward * _turn(body.rest.rotation) for body in bodies.bodies))


def euler_angles(rotation: Rotation) -> tuple[str, Array]:
    """The order of axes in which rotations stay farthest from gimbal lock, and the angles [rad], shape [T, 3].

    The first axis of the order is rotated last, as in BVH files. Angles have no jumps.
    """
    best: tuple[float, str, Array] | None = None
    for order in EULER_ORDERS:
        # small angles in all orders: the first order wins
        angles = _angles(rotation.as_matrix(), order)
        lock = float(np.abs(angles[:, 1]).max())
        if best is None or lock < best[0] - 1e-6:
            best = lock, order, angles
    assert best is not None
    return best[1], np.unwrap(best[2], axis=0)


def interpolated_values(
    skeleton: ParallelSkeleton, times: Array, translations: Array, orders: list[str], angles: Array, pieces: int
) -> tuple[Array, Array]:
    """Values of the motors where a player interpolates the channels by lines.

    Args:
        skeleton: The skeleton.
        times: Of the frames [s], shape [T].
        translations: [m], shape [T, B, 3].
        orders: Of the Euler angles of each joint.
        angles: [rad], shape [T, B, 3].
        pieces: Into which a frame is divided, since lines of angles are no lines of a motor whose axis is oblique.

    Returns:
        Times [s], shape [n], and values, shape [n, M].
    """
    fine = np.interp(np.arange((len(times) - 1) * pieces + 1) / pieces, np.arange(len(times)), times)
    moved = _lines(fine, times, translations)
    turned = _lines(fine, times, angles)
    rotations = [Rotation.from_euler(order, turned[:, k]) for k, order in enumerate(orders)]
    return fine, motor_values(skeleton.bodies, skeleton.local(fine, moved, rotations))


def _lines(at: Array, times: Array, values: Array) -> Array:
    flat = values.reshape(len(times), -1)
    return np.stack([np.interp(at, times, column) for column in flat.T], axis=1).reshape(len(at), *values.shape[1:])


def _angles(matrices: Array, order: str) -> Array:
    """Angles of R = R_first R_second R_third about three different axes [rad], shape [T, 3]."""
    i, j, k = ("XYZ".index(axis) for axis in order)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    R = matrices
    middle = np.arcsin(np.clip(sign * R[:, i, k], -1.0, 1.0))
    first = np.arctan2(-sign * R[:, j, k], R[:, k, k])
    third = np.arctan2(-sign * R[:, i, j], R[:, i, i])
    return np.stack([first, middle, third], axis=1)


def _onto_y(up: Array) -> Rotation:
    """The shortest rotation that takes a unit vector to y."""
    axis, y = np.cross(up, [0.0, 1.0, 0.0]), float(up[1])
    size = float(np.linalg.norm(axis))
    if size < 1e-9:
        return Rotation.identity() if y > 0.0 else Rotation.from_rotvec([np.pi, 0.0, 0.0])
    return Rotation.from_rotvec(axis / size * np.arctan2(size, y))


def _turn(quaternions: Array) -> Rotation:
    return Rotation.from_quat(np.roll(quaternions, -1, axis=-1))
