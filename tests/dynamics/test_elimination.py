"""Elimination along the tree against dense linear algebra."""

import numpy as np
import pytest
from calmotion.dynamics import elimination
from calmotion.dynamics.assembly import allocate_work, assemble
from calmotion.dynamics.system import Blocks, Scheme, allocate_blocks, allocate_factors
from dense import dense_matrix, join, offsets, split
from particles import particle_system, random_state
from test_assembly import TREES


def eliminated(name):
    parents, elastic, rows = TREES[name]
    rng = np.random.default_rng(2)
    system, _ = particle_system(rng, parents, elastic, rows)
    state = random_state(rng, system)
    Hv = np.zeros((len(parents), 4, 4))
    Hv[:, 0, 0] = 50.0
    Hv[:, 1:, 1:] = 50.0 * np.eye(3)
    blocks = allocate_blocks(system)
    zero, vector = np.zeros((len(parents), system.size)), np.zeros(len(parents))
    assemble(
        system,
        Scheme(50.0, 50.0, 1.0, 100.0),
        state.c,
        state.q,
        state.u,
        state.V,
        zero,
        state.lam,
        vector,
        vector,
        Hv,
        True,
        allocate_work(system),
        blocks,
    )
    A = dense_matrix(system, Blocks(*[part.copy() for part in blocks]))
    for b, row in enumerate(system.rows):
        for i in range(row, 6):
            A[offsets(system)[b] + 6 + elastic[b] + i, offsets(system)[b] + 6 + elastic[b] + i] = 1.0
    factors = allocate_factors(system)
    assert elimination.factor(system, blocks, factors.lu, factors.pivots, factors.Z) == -1
    return system, blocks, factors, A


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("transposed", [False, True], ids=["plain", "transposed"])
def test_solution_is_that_of_the_dense_matrix(name, transposed):
    system, blocks, factors, A = eliminated(name)
    b = np.random.default_rng(3).normal(size=len(A))
    x, lam = split(system, b)
    solve = elimination.solve_transposed if transposed else elimination.solve
    solve(
        system,
        blocks.Lp,
        blocks.Hp,
        blocks.Nc,
        blocks.Jp,
        factors.lu,
        factors.pivots,
        factors.Z,
        x,
        lam,
        np.zeros(system.size + 6),
    )
    M = A.T if transposed else A
    found = join(system, x, lam)
    assert np.abs(M @ found - b).max() < 1e-9
    assert np.allclose(found, np.linalg.solve(M, b), rtol=1e-7, atol=1e-9)


def test_singular_component_is_named():
    system, blocks, factors, _ = eliminated("flexible chain")
    blocks.K[1] = 0.0
    blocks.Lc[1] = 0.0
    assert elimination.factor(system, blocks, factors.lu, factors.pivots, factors.Z) == 1


def test_dense_factors_solve_a_matrix_that_needs_pivoting():
    A = np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 0.0], [3.0, 1.0, 0.0]])
    lu, piv, b = A.copy(), np.zeros(3, np.int32), np.array([1.0, 2.0, 3.0])
    assert elimination.lu_factor(3, lu, piv)
    x, y = b.copy(), b.copy()
    elimination.lu_solve(3, lu, piv, x)
    elimination.lu_solve_transposed(3, lu, piv, y)
    assert np.abs(A @ x - b).max() < 1e-14 and np.abs(A.T @ y - b).max() < 1e-14
