"""The two maps from small-rotation coordinates to rotations."""

import numpy as np
import pytest
from calmotion.multibody.kernels.finite_rotation import interface_rotation, interface_rotation_derivative
from scipy.spatial.transform import Rotation


def maps(kind, psi):
    R, H = np.zeros((3, 3)), np.zeros((3, 3))
    interface_rotation(kind, np.asarray(psi, dtype=float), R, H)
    return R, H


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.3, 1.2, 1.55])
def test_of_a_nonlinear_body_the_skew_part_of_the_rotation_is_given(angle):
    axis = np.array([0.6, -0.64, 0.48])
    expected = Rotation.from_rotvec(angle * axis).as_matrix()
    S = 0.5 * (expected - expected.T)
    R, _ = maps(1, [S[2, 1], S[0, 2], S[1, 0]])
    assert np.allclose(R, expected, atol=1e-13)


def test_of_a_linear_body_it_is_the_exponential():
    psi = [2.1, -0.7, 0.4]
    assert np.allclose(maps(0, psi)[0], Rotation.from_rotvec(psi).as_matrix())


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_the_jacobian_and_its_derivative(kind):
    rng = np.random.default_rng(kind)
    psi, b = 0.3 * rng.normal(size=3), rng.normal(size=3)
    R, H = maps(kind, psi)
    h = 1e-6
    turns, slopes, transposed = [], [], []
    for e in h * np.eye(3):
        up, down = maps(kind, psi + e), maps(kind, psi - e)
        spin = R.T @ (up[0] - down[0]) / (2 * h)
        turns.append([spin[2, 1], spin[0, 2], spin[1, 0]])
        slopes.append((up[1] - down[1]) @ b / (2 * h))
        transposed.append((up[1] - down[1]).T @ b / (2 * h))
    assert np.allclose(H, np.transpose(turns), atol=1e-8)
    out = np.zeros((3, 3))
    interface_rotation_derivative(kind, psi, b, 1.0, out)
    assert np.allclose(out, np.transpose(slopes), atol=1e-8)
    # H(-psi) = H(psi)^T, so `sign` -1 differentiates the transpose
    assert np.allclose(maps(kind, -psi)[1], H.T)
    interface_rotation_derivative(kind, psi, b, -1.0, out)
    assert np.allclose(out, np.transpose(transposed), atol=1e-8)


def test_beyond_90_degrees_it_is_nan():
    assert np.isnan(maps(1, [0.0, 1.01, 0.0])[0]).any()
