"""Elimination along the tree against dense linear algebra."""

import numpy as np
import pytest
from calmotion.multibody.linear_solver import elimination
from calmotion.multibody.linear_solver.closed_chains import (
    factor_closed_chains,
    solve_system,
    solve_system_transposed,
    solve_with_border,
)
from calmotion.multibody.linear_solver.step_matrix import allocate_border, allocate_solution
from dense import join, split
from eliminated import eliminated
from trees import TREES


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("kind", ["plain", "transposed", "with the border"])
def test_solution_is_that_of_the_dense_matrix(name, kind):
    system, _, matrix, A = eliminated(name)
    b = np.random.default_rng(3).normal(size=len(A))
    x, lam = split(system, b)
    border, scratch = allocate_border(system), allocate_solution(system)
    factor_closed_chains(system, matrix, border)
    if kind == "with the border":
        solve_with_border(system, matrix, border, x, lam, scratch)
    else:
        (solve_system_transposed if kind == "transposed" else solve_system)(system, matrix, x, lam, scratch)
    M = A.T if kind == "transposed" else A
    found = join(system, x, lam)
    assert np.abs(M @ found - b).max() < 1e-12 * (np.abs(M) @ np.abs(found)).max()
    assert np.allclose(found, np.linalg.solve(M, b), rtol=1e-7, atol=1e-9)


def test_singular_component_is_named():
    system, blocks, matrix, _ = eliminated("flexible chain")
    blocks.K[1] = 0.0
    blocks.Lc[1] = 0.0
    assert elimination.factor(system, blocks, matrix, np.zeros(system.size)) == 1


def test_dense_factors_solve_a_matrix_that_needs_pivoting():
    A = np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 0.0], [3.0, 1.0, 0.0]])
    lu, piv, b = A.copy(), np.zeros(3, np.int32), np.array([1.0, 2.0, 3.0])
    assert elimination.lu_factor(3, lu, piv)
    x, y = b.copy(), b.copy()
    elimination.lu_solve(3, lu, piv, x)
    elimination.lu_solve_transposed(3, lu, piv, y)
    assert np.abs(A @ x - b).max() < 1e-14 and np.abs(A.T @ y - b).max() < 1e-14
