"""Rigid poses out of matrices."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.support import rotation_from_quaternion
from calmotion.usd import transforms


def rotation(seed: int) -> np.ndarray:
    return rotation_from_quaternion(np.random.default_rng(seed).normal(size=4))


def affine(linear: np.ndarray, offset=(1.0, 2.0, 3.0)) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = linear, offset
    return out


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 3, 0.5), (-2, -2, -2), (1, 1, -1)])
def test_a_pose_puts_its_matrix_together_again(scale):
    matrix = affine(rotation(1) * np.array(scale))
    if scale == (1, 1, -1):
        # mirrored along one axis is a half turn and a mirror along all three: other axes, the same sizes
        pose = transforms.pose_from_matrix(matrix, "/a")
        assert np.linalg.det(pose.rotation) == pytest.approx(1.0)
    else:
        pose = transforms.pose_from_matrix(matrix, "/a")
        assert np.allclose(pose.rotation, rotation(1), atol=1e-12)
    assert np.allclose(pose.matrix(), matrix, atol=1e-12)


def test_local_points_are_where_the_pose_puts_them():
    pose = transforms.pose_from_matrix(affine(rotation(2) * 3.0), "/a")
    local = np.array([[0.1, 0.2, 0.3]])
    assert np.allclose(pose.to_local(local @ pose.rotation.T + pose.position), local)


@pytest.mark.parametrize(("axis", "direction"), [("X", [1, 0, 0]), ("Y", [0, 1, 0]), ("Z", [0, 0, 1])])
def test_the_axis_rotation_takes_z_to_the_axis(axis, direction):
    turn = transforms.axis_rotation(axis)
    assert np.array_equal(turn @ [0, 0, 1], direction)
    assert np.linalg.det(turn) == pytest.approx(1.0) and np.allclose(turn.T @ turn, np.eye(3))


@pytest.mark.parametrize("row", [(0.0, 0.0, 0.0, 2.0), (0.1, 0.0, 0.0, 1.0)])
def test_a_matrix_that_is_not_affine_is_refused(row):
    matrix = np.eye(4)
    matrix[3] = row
    with pytest.raises(ShotError, match="not affine"):
        transforms.pose_from_matrix(matrix, "/A")


def test_a_matrix_of_single_precision_is_affine():
    matrix = np.eye(4)
    matrix[3, 3] = np.float32(1.0) - np.float32(1.2e-7)
    assert np.allclose(transforms.pose_from_matrix(matrix, "/A").rotation, np.eye(3))
