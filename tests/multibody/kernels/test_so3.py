"""Rotations against scipy and central differences."""

import numpy as np
import pytest
from calmotion.multibody.kernels import so3
from scipy.spatial.transform import Rotation

ANGLES = [0.0, 1e-9, 1e-4, 0.09, 0.11, 1.0, 2.5, 3.1]


def vector(rng, angle):
    axis = rng.normal(size=3)
    return angle * axis / np.linalg.norm(axis)


def call(function, *args, shape=(3, 3)):
    out = np.zeros(shape)
    function(*args, out)
    return out


@pytest.mark.parametrize("angle", ANGLES)
def test_exponential_is_the_rotation_of_scipy(angle):
    t = vector(np.random.default_rng(1), angle)
    assert np.abs(call(so3.exponential, t) - Rotation.from_rotvec(t).as_matrix()).max() < 1e-15


@pytest.mark.parametrize("angle", ANGLES)
def test_logarithm_undoes_the_exponential(angle):
    t = vector(np.random.default_rng(2), angle)
    assert np.abs(call(so3.logarithm, call(so3.exponential, t), shape=3) - t).max() < 1e-12


@pytest.mark.parametrize("angle", ANGLES)
def test_right_jacobian_is_the_derivative_of_the_exponential(angle):
    rng = np.random.default_rng(3)
    t, d, e = vector(rng, angle), rng.normal(size=3), 1e-6
    R = Rotation.from_rotvec(t)
    change = (
        (R.inv() * Rotation.from_rotvec(t + e * d)).as_rotvec()
        - (R.inv() * Rotation.from_rotvec(t - e * d)).as_rotvec()
    ) / (2 * e)
    J = call(so3.right_jacobian, t)
    assert np.abs(J @ d - change).max() < 1e-9
    assert np.abs(J @ call(so3.inverse_right_jacobian, t) - np.eye(3)).max() < 1e-12


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("angle", ANGLES)
def test_derivative_of_the_right_jacobian_matches_central_differences(angle, sign):
    rng = np.random.default_rng(4)
    t, b, e = vector(rng, angle), rng.normal(size=3), 1e-5
    expected = np.zeros((3, 3))
    for k in range(3):
        d = e * np.eye(3)[k]
        plus, minus = call(so3.right_jacobian, sign * (t + d)), call(so3.right_jacobian, sign * (t - d))
        expected[:, k] = (plus - minus) @ b / (2 * e)
    assert np.abs(call(so3.right_jacobian_derivative, t, b, sign) - expected).max() < 1e-9


@pytest.mark.parametrize("angle", ANGLES)
def test_a_quaternion_update_is_a_product_of_rotations(angle):
    rng = np.random.default_rng(5)
    q, t = Rotation.random(random_state=1), vector(rng, angle)
    out = call(so3.turn, np.roll(q.as_quat(), 1), t, shape=4)
    expected = (q * Rotation.from_rotvec(t)).as_matrix()
    assert np.abs(call(so3.matrix_of, out) - expected).max() < 1e-15
    assert abs(np.linalg.norm(out) - 1.0) < 1e-15
    assert np.abs(call(so3.matrix_of, call(so3.quaternion_of, expected, shape=4)) - expected).max() < 1e-14
