"""Rotations as matrices and as quaternions."""

import numpy as np
from calmotion.support import quaternion_from_rotation, rotation_from_quaternion


def test_quaternions_and_rotations_agree():
    quaternions = np.random.default_rng(3).normal(size=(2, 3, 4))
    turns = rotation_from_quaternion(quaternions)
    w, x, y, z = np.moveaxis(quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True), -1, 0)
    assert np.allclose(turns[..., 0, 0], 1.0 - 2.0 * (y * y + z * z))
    assert np.allclose(turns[..., 1, 0], 2.0 * (x * y + w * z))
    assert np.allclose(rotation_from_quaternion(quaternion_from_rotation(turns)), turns)
