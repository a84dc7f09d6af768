"""Modes from rough ones by an approximate inverse, where the modes are known."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.linear_algebra.preconditioned_modes import improved_modes
from scipy.sparse import diags, identity, kron
from scipy.sparse.linalg import splu

WIDTH = 5


def membrane(n):
    """A square membrane, whose values are there twice where i != j, and all of them, ascending."""
    chain = diags([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], [-1, 0, 1], format="csr")
    one = 2.0 - 2.0 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1))
    return (kron(chain, identity(n)) + kron(identity(n), chain)).tocsc(), np.sort((one[:, None] + one).ravel())


def rough(K):
    """Low modes with noise, and the inverse of a matrix with other numbers on the diagonal."""
    rng = np.random.default_rng(0)
    _, vectors = np.linalg.eigh(K.toarray())
    start = vectors[:, :WIDTH] + 0.02 * rng.standard_normal((K.shape[0], WIDTH))
    return start, splu((K + diags(0.1 * rng.random(K.shape[0]))).tocsc()).solve


@pytest.mark.parametrize("accuracy", [1e-3, 1e-8])
def test_modes_are_as_accurate_as_asked(accuracy):
    K, exact = membrane(20)
    start, inverse = rough(K)
    before = np.diag(start.T @ (K @ start)) / np.diag(start.T @ start)
    assert (before[:3] > (1.0 + 100.0 * accuracy) * exact[:3] / 3.0).all()
    values, vectors = improved_modes(K, lambda x: 3.0 * x, inverse, start, 3, accuracy)
    assert (np.abs(3.0 * values[:3] / exact[:3] - 1.0) < 10.0 * accuracy).all() and (
        3.0 * values > 0.999 * exact[:5]
    ).all()
    assert np.abs(3.0 * vectors.T @ vectors - np.eye(WIDTH)).max() < 1e-8
    assert np.allclose(np.diag(vectors.T @ (K @ vectors)), values, rtol=1e-8)


def test_exact_modes_stay():
    K, exact = membrane(12)
    _, vectors = np.linalg.eigh(K.toarray())
    calls = []

    def inverse(x):
        calls.append(1)
        return splu(K).solve(x)

    values, _ = improved_modes(K, lambda x: x, inverse, vectors[:, :WIDTH], 3, 1e-9)
    assert len(calls) == 1 and np.allclose(values, exact[:WIDTH], rtol=1e-10)


def test_what_does_not_converge_is_none():
    K, _ = membrane(20)
    start, _ = rough(K)
    assert improved_modes(K, lambda x: x, lambda x: np.full_like(x, np.nan), start, 3, 1e-6) is None
    assert improved_modes(K, lambda x: x, lambda x: 1e-3 * x, np.ones_like(start), 3, 1e-6) is None  # one vector
    noise = np.random.default_rng(3).standard_normal(start.shape)
    assert improved_modes(K, lambda x: x, lambda x: x, noise, 3, 1e-14) is None  # no inverse at all
