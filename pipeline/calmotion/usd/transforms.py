"""Rigid poses of affine transforms, and conversions of rotations. Lengths may be in stage units or SI."""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model.character import Frame
from calmotion.support.rotations import quaternion_from_rotation

_HUGE = 1e30
_AFFINE = 1e-6  # matrices that were computed in single precision have 0.9999999 in the corner
_SHEAR_TOLERANCE = 1e-4  # xforms are often authored in single precision


@dataclass(frozen=True, eq=False)
class Pose:
    """A transform x -> R diag(scale) x + t.

    Attributes:
        rotation: R, shape [3, 3], a proper rotation.
        position: t, shape [3].
        scale: Shape [3]; all three negative for a mirrored prim.
    """

    rotation: Array
    position: Array
    scale: Array

    def frame(self, meters: float) -> Frame:
        """The pose without its scale, in SI."""
        return Frame(self.position * meters, quaternion_from_rotation(self.rotation))

    def matrix(self) -> Array:
        """The transform with its scale, shape [4, 4], mapping column vectors."""
        out = np.eye(4)
        out[:3, :3] = self.rotation * self.scale
        out[:3, 3] = self.position
        return out

    def to_local(self, points: Array) -> Array:
        """Points [n, 3] of the outer space in the axes of the pose without its scale."""
        return (points - self.position) @ self.rotation


def pose_from_matrix(matrix: Array, path: str) -> Pose:
    """Split an affine matrix into rotation, position and scale.

    Args:
        matrix: Shape [4, 4], maps column vectors.
        path: Prim path, for the message.

    Raises:
        ShotError: The matrix shears, or is singular, not affine or not finite.
    """
    linear = matrix[:3, :3]
    refuse_infinite(matrix, path)
    if np.any(np.abs(matrix[3] - [0.0, 0.0, 0.0, 1.0]) > _AFFINE):
        raise ShotError(
            "its transform is not affine",
            path=path,
            attribute="xformOpOrder",
            found=f"last column {matrix[3].tolist()}",
            remedy="Author (0, 0, 0, 1) in the last column of its matrix",
        )
    scale = np.linalg.norm(linear, axis=0)
    if np.min(scale) <= 1e-12 * max(1.0, float(np.max(scale))):
        raise ShotError(
            "its transform has a scale of zero",
            path=path,
            attribute="xformOpOrder",
            found=scale.tolist(),
            remedy="Give it a scale that is not zero",
        )
    if np.linalg.det(linear) < 0.0:
        scale = -scale
    rotation = linear / scale
    if np.max(np.abs(rotation.T @ rotation - np.eye(3))) > _SHEAR_TOLERANCE:
        raise ShotError(
            "its transform shears and so has no rigid pose (a cause is a non-uniform scale above a rotation)",
            path=path,
            attribute="xformOpOrder",
            remedy="Freeze the scale of the prims above it into their geometry",
        )
    # Remove rounding errors of single precision: take the nearest rotation.
    u, _, vt = np.linalg.svd(rotation)
    return Pose(u @ vt, matrix[:3, 3].copy(), scale)


def refuse_infinite(matrix: Array, path: str) -> None:
    """Refuse a transform with values that are not finite, or that exceed 1e30.

    Raises:
        ShotError: The transform has such a value.
    """
    if not np.all(np.abs(matrix) < _HUGE):
        raise ShotError(
            "its transform is not finite",
            path=path,
            attribute="xformOpOrder",
            found=f"{float(np.max(np.abs(matrix))):g}",
            remedy="Correct the transform",
        )


def axis_rotation(axis: str) -> Array:
    """The rotation, shape [3, 3], that takes the z axis to the named axis `X`, `Y` or `Z`."""
    if axis == "X":
        return np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    if axis == "Y":
        return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return np.eye(3)
