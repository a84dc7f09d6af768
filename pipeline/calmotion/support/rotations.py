"""Rotations as matrices and as unit quaternions (w, x, y, z)."""

import numpy as np

from calmotion.arrays import Array


def quaternion_from_rotation(rotation: Array) -> Array:
    """Unit quaternions (w, x, y, z), w >= 0, shape [..., 4], of rotation matrices [..., 3, 3]."""
    from scipy.spatial.transform import Rotation

    # SciPy takes more than one axis of rotations since 1.17
    flat = np.reshape(rotation, (-1, 3, 3))
    quaternions: Array = Rotation.from_matrix(flat).as_quat(canonical=True, scalar_first=True)
    return quaternions.reshape(*np.shape(rotation)[:-2], 4)


def rotation_from_quaternion(quaternion: Array) -> Array:
    """Rotation matrices [..., 3, 3] of quaternions (w, x, y, z) [..., 4], which are normalised first."""
    from scipy.spatial.transform import Rotation

    flat = np.reshape(quaternion, (-1, 4))
    rotations: Array = Rotation.from_quat(flat, scalar_first=True).as_matrix().reshape(*np.shape(quaternion)[:-1], 3, 3)
    return rotations
