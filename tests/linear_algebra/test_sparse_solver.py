"""Sparse Cholesky factors against dense solutions and SciPy's."""

import numpy as np
import pytest
from calmotion.linear_algebra import multifrontal
from calmotion.linear_algebra.multifrontal import FactorsTooLarge, NotPositiveDefinite
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.reduction.elements.assembly import assemble
from scipy.sparse import block_diag, csr_matrix, diags, identity
from scipy.sparse import random as random_matrix
from scipy.sparse.linalg import splu


@pytest.fixture(scope="module")
def stiffness(helpers, steel):
    """Of a clamped block of irregular elements, and its free nodes."""
    points, tets = helpers.box((7, 5, 4), (0.7, 0.5, 0.4))
    inner = (points > 1e-9).all(axis=1) & (points < np.array([0.7, 0.5, 0.4]) - 1e-9).all(axis=1)
    points[inner] += 0.02 * np.random.default_rng(1).uniform(-1, 1, size=(inner.sum(), 3))
    model = assemble(points, tets, steel)
    free = model.mesh.nodes[:, 0] > 1e-9
    dofs = np.flatnonzero(np.repeat(free, 3))
    return model.stiffness[dofs][:, dofs], model.mesh.nodes[free]


@pytest.mark.parametrize("with_points", [True, False])
def test_it_solves_the_stiffness_of_a_body_as_superlu_does(stiffness, with_points):
    K, points = stiffness
    assert K.shape[0] > 3000
    b = np.random.default_rng(0).standard_normal((K.shape[0], 3))
    x = SparseSolver(K, points if with_points else None).solve(b)
    expected = splu(K.tocsc()).solve(b)
    assert np.abs(x - expected).max() < 1e-11 * np.abs(expected).max()
    assert np.abs(K @ x - b).max() < 1e-9


def test_factors_are_smaller_than_those_of_superlu(stiffness):
    K, points = stiffness
    lu = splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    assert SparseSolver(K, points).entries < lu.L.nnz + lu.U.nnz


@pytest.mark.parametrize("n", [1, 2, 3, 7, 200, 301])
def test_it_solves_random_matrices_of_any_size(n):
    rng = np.random.default_rng(n)
    A = random_matrix(n, n, density=min(1.0, 4.0 / n), random_state=rng, format="csr")
    A = A @ A.T + 0.1 * identity(n)
    b = rng.standard_normal(n)
    x = SparseSolver(A).solve(b)
    assert x.shape == (n,)
    assert np.allclose(x, np.linalg.solve(A.toarray(), b), rtol=1e-8, atol=1e-10)


def test_it_solves_parts_that_do_not_hang_together_and_rows_that_are_full(stiffness):
    K, _ = stiffness
    small = K[:600][:, :600]
    full = np.full(K.shape[0] + 600, 1e-3 * K.diagonal().min())
    both = block_diag([K, small], format="csr")
    A = (both + 0.0 * both).tolil()
    A[5, :] += full
    A[:, 5] += full[:, None]
    A = (A + diags(np.where(np.arange(len(full)) == 5, K.diagonal().max(), 0.0))).tocsr()
    b = np.random.default_rng(2).standard_normal(A.shape[0])
    x = SparseSolver(A).solve(b)
    assert np.abs(A @ x - b).max() < 1e-8


def test_no_right_hand_side_and_none_changed(stiffness):
    K, points = stiffness
    solver = SparseSolver(K, points)
    b = np.random.default_rng(0).standard_normal((K.shape[0], 2))
    before = b.copy()
    first = solver.solve(b)
    assert np.array_equal(b, before) and np.array_equal(first, solver.solve(b))
    assert np.array_equal(SparseSolver(K, points).solve(b), first)  # a run repeats to the last bit
    assert solver.solve(b[:, :0]).shape == (K.shape[0], 0)
    assert np.allclose(solver.solve(np.asfortranarray(b)), first, rtol=1e-12)


def test_a_matrix_that_is_not_positive_definite_is_refused(helpers, steel):
    model = assemble(*helpers.box((2, 1, 1), (0.2, 0.1, 0.1)), steel)
    K = model.stiffness - 1e-3 * model.stiffness.diagonal().mean() * identity(model.stiffness.shape[0])
    with pytest.raises(NotPositiveDefinite):
        SparseSolver(K)
    with pytest.raises(NotPositiveDefinite):
        SparseSolver(csr_matrix(np.array([[np.nan]])))


def test_factors_that_do_not_fit_into_the_memory_are_refused(stiffness, monkeypatch):
    K, points = stiffness
    needed = 8.0 * SparseSolver(K, points).entries
    monkeypatch.setattr(multifrontal, "available_memory", lambda: needed)
    with pytest.raises(FactorsTooLarge, match=f"{len(points)} nodes") as refused:
        SparseSolver(K, points)
    assert refused.value.attribute == "calm:flexible:elementSize"
    monkeypatch.setattr(multifrontal, "available_memory", lambda: 2.0 * needed)
    SparseSolver(K, points)


def test_a_scaled_matrix_has_the_same_factors():
    K = diags([[-1.0] * 8, [3.0] * 9, [-1.0] * 8], [-1, 0, 1]).tocsr()
    b = np.arange(18.0).reshape(9, 2)
    solver = SparseSolver(K)
    np.testing.assert_allclose(solver.scaled(4.0).solve(b), SparseSolver(4.0 * K).solve(b), rtol=1e-12)
    np.testing.assert_array_equal(solver.scaled(4.0).scaled(0.25).solve(b), solver.solve(b))
