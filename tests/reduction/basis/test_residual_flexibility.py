"""Residual vectors, and how many of them a tolerance needs, on random systems."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.reduction.basis.residual_flexibility import (
    StaticModel,
    largest_displacement,
    largest_displacement_by_mode,
    needed_coordinates,
    residual_vectors,
)
from scipy.linalg import eigh
from scipy.sparse import csr_matrix


@pytest.fixture
def system():
    rng = np.random.default_rng(4)
    A, B = rng.normal(size=(2, 40, 40))
    K, M = A @ A.T + 0.1 * np.eye(40), B @ B.T + 5.0 * np.eye(40)
    values, modes = eigh(K, M)
    return csr_matrix(K), M, values[:6], modes[:, :6], rng.normal(size=(40, 4))


def test_modes_and_residual_vectors_together_span_the_static_response(system):
    K, M, values, modes, loads = system
    weight = np.array([1.0, 10.0, 0.1, 1.0])
    V, work = residual_vectors(K, loads, weight, values, modes, SparseSolver(K).solve(loads))
    assert V.shape == (40, 4) and (np.diff(work) <= 0.0).all()
    assert np.abs(V.T @ (K @ V) - np.eye(4)).max() < 1e-10
    assert np.abs(V.T @ (M @ modes)).max() < 1e-9 * np.abs(V).max()
    response = modes @ ((modes.T @ loads) / values[:, None]) + V @ (V.T @ loads)
    expected = np.linalg.solve(K.toarray(), loads)
    assert np.abs(response - expected).max() < 1e-10 * np.abs(expected).max()
    left = np.einsum("ij,ij->", loads * weight, np.linalg.solve(K.toarray(), loads * weight))
    left -= np.sum((modes.T @ (loads * weight)) ** 2 / values[:, None])
    assert work.sum() == pytest.approx(left)


def static_model(rng, r=12, loads=5, outputs=2):
    omega_squared = np.sort(rng.uniform(1.0, 100.0, size=r))
    return StaticModel(omega_squared, rng.normal(size=(r, loads)), rng.normal(size=(outputs, 3, r)))


@pytest.mark.parametrize("tolerance", [10.0, 1.0, 0.1, 0.01, 0.0])
def test_the_missing_part_is_as_estimated_and_within_the_tolerance(tolerance):
    static = static_model(np.random.default_rng(6))
    kept = np.arange(12) < 3
    combination, residual, missing = needed_coordinates(static, kept, tolerance)
    assert np.allclose(combination.T @ combination, np.eye(combination.shape[1]), atol=1e-12)
    K = combination.T @ (static.omega_squared[:, None] * combination)
    assert np.allclose(K, np.diag(np.diag(K)), atol=1e-10) and (np.diff(np.diag(K)) >= -1e-12).all()
    assert residual.sum() + 3 == combination.shape[1]
    # the kept modes are there as they are
    assert np.allclose(np.abs(combination[:3, ~residual]), np.eye(3))
    own = StaticModel(np.diag(K), combination.T @ static.loads, static.outputs @ combination)
    assert largest_displacement(static.response - own.response) == pytest.approx(missing, abs=1e-12)
    assert missing <= tolerance or residual.sum() == 5


def test_residual_vectors_are_never_more_than_loads_and_fewer_for_a_larger_tolerance():
    static = static_model(np.random.default_rng(7))
    counts = [needed_coordinates(static, np.zeros(12, bool), t)[1].sum() for t in (1e3, 1.0, 0.1, 0.0)]
    assert counts[0] == 0 and counts[-1] == 5 and (np.diff(counts) >= 0).all()


def test_the_displacement_of_a_mode_alone_is_the_worst_of_all_signs_of_the_loads():
    rng = np.random.default_rng(9)
    static = static_model(rng)
    worst = np.zeros(12)
    for signs in np.stack(np.meshgrid(*[[-1.0, 1.0]] * 5)).reshape(5, -1).T:
        u = (static.loads @ signs) / static.omega_squared
        worst = np.maximum(worst, np.linalg.norm(static.outputs * u, axis=1).max(axis=0))
    assert np.allclose(largest_displacement_by_mode(static), worst)
