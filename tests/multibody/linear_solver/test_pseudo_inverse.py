"""The small pseudo-inverse against numpy's."""

import numpy as np
import pytest
from calmotion.multibody.linear_solver.pseudo_inverse import allocate_decomposition, pseudo_inverse


def compute(A):
    n = len(A)
    out, null = np.zeros((2, n, n))
    rank = pseudo_inverse(n, A.copy(), out, null, allocate_decomposition(n))
    return rank, out, null[:, : n - rank]


@pytest.mark.parametrize(("n", "rank"), [(1, 1), (9, 9), (9, 6), (18, 12), (27, 26), (5, 0)])
def test_it_is_that_of_moore_and_penrose(n, rank):
    rng = np.random.default_rng(n + rank)
    A = rng.normal(size=(n, rank)) @ rng.normal(size=(rank, n))
    found, inverse, null = compute(A)
    assert found == rank
    assert np.allclose(inverse, np.linalg.pinv(A, 1e-10), atol=1e-9)
    assert null.shape == (n, n - rank)
    assert np.abs(A @ null).max(initial=0.0) < 1e-12 * max(1.0, np.abs(A).max(initial=0.0)) * n
    assert np.allclose(null.T @ null, np.eye(n - rank), atol=1e-12)


def test_zero_columns_and_rows_are_no_trouble():
    A = np.zeros((4, 4))
    A[1, 2] = 3.0
    rank, inverse, _ = compute(A)
    assert rank == 1 and np.allclose(inverse, np.linalg.pinv(A))
