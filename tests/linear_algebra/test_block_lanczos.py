"""Eigenpairs of matrices whose eigenvalues are known."""

import numpy as np
import pytest
from calmotion.linear_algebra.block_lanczos import lowest_by_lanczos
from calmotion.linear_algebra.sparse_solver import SparseSolver
from scipy.sparse import diags, identity, kron


def chain(n):
    return diags([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], [-1, 0, 1], format="csr")


def membrane(n, copies=1):
    """A square membrane: every eigenvalue i, j with i != j is there twice, and all of them `copies` times."""
    K = kron(chain(n), identity(n)) + kron(identity(n), chain(n))
    one = 2.0 - 2.0 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1))
    values = np.sort(np.repeat((one[:, None] + one).ravel(), copies))
    return kron(identity(copies), K).tocsr(), values


@pytest.mark.parametrize("copies", [1, 5])
@pytest.mark.parametrize("count", [1, 7, 40])
def test_all_of_the_lowest_modes_are_found_also_multiple_ones(copies, count):
    K, exact = membrane(20, copies)
    M = 3.0 * identity(K.shape[0], format="csr")
    values, vectors = lowest_by_lanczos(K, M, count, 0.0, SparseSolver(K), None, K.shape[0])
    assert np.allclose(values, exact[:count] / 3.0, rtol=1e-12)
    assert np.abs(vectors.T @ (M @ vectors) - np.eye(count)).max() < 1e-12
    residual = np.linalg.norm(K @ vectors - (M @ vectors) * values, axis=0)
    assert (residual < 1e-8 * np.linalg.norm(K @ vectors, axis=0)).all()


def test_all_below_a_limit_are_found_and_one_above():
    K, exact = membrane(20)
    M = identity(K.shape[0], format="csr")
    for limit in (0.0, 0.3, 1.0):
        values, _ = lowest_by_lanczos(K, M, 3, 0.0, SparseSolver(K), limit, K.shape[0])
        below = np.count_nonzero(exact <= limit)
        assert len(values) == max(3, below + 1) and np.allclose(values, exact[: len(values)], rtol=1e-12)
    values, _ = lowest_by_lanczos(K, M, 3, 0.0, SparseSolver(K), 1.0, 10)
    assert len(values) == 10


def test_a_singular_stiffness_is_shifted():
    n = 300
    K = chain(n).tolil()
    K[0, 0] = K[-1, -1] = 1.0  # free at both ends
    K = K.tocsr()
    M = identity(n, format="csr")
    values, _ = lowest_by_lanczos(K, M, 4, 1e-3, SparseSolver(K + 1e-3 * M), None, n)
    exact = 2.0 - 2.0 * np.cos(np.pi * np.arange(4) / n)
    assert np.allclose(values, exact, rtol=1e-10, atol=1e-15)


def test_a_small_space_is_exhausted():
    """Two values only: after two blocks there is nothing new."""
    n = 200
    K = diags(np.where(np.arange(n) < 120, 1.0, 4.0), format="csr")
    values, vectors = lowest_by_lanczos(K, identity(n, format="csr"), 3, 0.0, SparseSolver(K), None, n)
    assert np.allclose(values[:1], 1.0) and np.isfinite(vectors).all()
