"""The elastic program against SciPy: the minimum where constraints can be kept, the least excess where they cannot."""

import numpy as np
import pytest
from calmotion.retargeting.solver.elastic_program import elastic_minimum
from scipy.optimize import linprog, minimize
from scipy.sparse import csr_matrix


@pytest.mark.parametrize("seed", range(4))
def test_the_minimum_is_that_of_another_method(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(6, 6))
    H, c, G, b = root @ root.T + np.eye(6), rng.normal(size=6), rng.normal(size=(9, 6)), rng.uniform(-0.2, 1.0, 9)
    found = elastic_minimum(csr_matrix(H), c, csr_matrix(G), b, 1e4)
    expected = minimize(
        lambda x: 0.5 * x @ H @ x + c @ x, np.zeros(6), jac=lambda x: H @ x + c, method="SLSQP",
        constraints={"type": "ineq", "fun": lambda x: b - G @ x, "jac": lambda x: -G}, options={"ftol": 1e-14},
    )  # fmt: skip
    assert expected.success
    np.testing.assert_allclose(found.x, expected.x, atol=1e-6)
    # multipliers balance the gradient, and are zero where a constraint does not bind
    np.testing.assert_allclose(H @ found.x + c + G.T @ found.multipliers, 0.0, atol=1e-7)
    assert np.max(np.abs(found.multipliers * (b - G @ found.x))) < 1e-7


def test_rows_of_all_unknowns_beside_sparse_ones_are_kept_as_well():
    rng, n = np.random.default_rng(7), 40
    G, b = np.vstack([np.eye(n), -np.eye(n), np.ones(n), -np.ones(n)]), np.r_[np.ones(2 * n), 5.0, -5.0]
    c = rng.normal(size=n)
    found = elastic_minimum(csr_matrix(2.0 * np.eye(n)), c, csr_matrix(G), b, 1e4).x
    # clipped at one level, which the sum determines
    low, high = -10.0, 10.0
    for _ in range(80):
        level = 0.5 * (low + high)
        low, high = (level, high) if np.clip(level - 0.5 * c, -1.0, 1.0).sum() < 5.0 else (low, level)
    np.testing.assert_allclose(found, np.clip(level - 0.5 * c, -1.0, 1.0), atol=1e-6)


def test_constraints_that_exclude_each_other_are_exceeded_least():
    rng = np.random.default_rng(5)
    G, b = rng.normal(size=(8, 3)), np.full(8, -1.0)
    excess = np.maximum(
        G @ elastic_minimum(csr_matrix(1e-3 * np.eye(3)), np.zeros(3), csr_matrix(G), b, 1e4).x - b, 0.0
    )
    least = linprog(
        np.r_[np.zeros(3), np.ones(8)], np.c_[G, -np.eye(8)], b, bounds=[(None, None)] * 3 + [(0.0, None)] * 8
    )
    assert least.fun > 0.1
    assert excess.sum() == pytest.approx(least.fun, rel=1e-5)


@pytest.mark.parametrize("seed", range(2, 5))
def test_constraints_far_out_of_reach_have_all_the_multiplier_that_there_is(seed):
    rng, count, rho = np.random.default_rng(seed), 400, 73.0
    rows = 40.0 * rng.normal(size=(count, 6))
    G, low = np.concatenate([rows, -rows]), -380.0 * rng.uniform(size=count)
    b = np.concatenate([low, 380.0 * rng.uniform(size=count) * (rng.uniform(size=count) < 0.5) - 100.0])
    H = np.diag(rng.uniform(0.005, 0.02, 6))
    with np.errstate(all="raise"):
        found = elastic_minimum(csr_matrix(H), np.zeros(6), csr_matrix(G), b, rho)
    assert np.all((found.multipliers >= 0.0) & (found.multipliers <= rho * (1.0 + 1e-12)))
    assert np.all(np.abs(H @ found.x + G.T @ found.multipliers) < 1e-9 * (np.abs(G.T) @ found.multipliers))
