"""Many right-hand sides at once against each alone."""

import numpy as np
import pytest
from calmotion.multibody.linear_solver.block_solution import allocate_block_solution, solve_block
from calmotion.multibody.linear_solver.closed_chains import factor_closed_chains, solve_system
from calmotion.multibody.linear_solver.step_matrix import allocate_border, allocate_solution
from eliminated import eliminated
from trees import TREES


@pytest.mark.parametrize("name", TREES)
def test_each_column_is_the_solution_of_its_right_hand_side(name):
    system, _, matrix, _ = eliminated(name)
    scratch = allocate_solution(system)
    factor_closed_chains(system, matrix, allocate_border(system))
    rng, columns = np.random.default_rng(5), 3
    x = rng.normal(size=(len(system.parent), system.size, columns))
    lam = rng.normal(size=(len(system.rows), 6, columns))
    expected = [(x[..., q].copy(), lam[..., q].copy()) for q in range(columns)]
    solve_block(system, matrix, x, lam, allocate_block_solution(system, columns))
    for q, (single, multipliers) in enumerate(expected):
        solve_system(system, matrix, single, multipliers, scratch)
        for b, elastic in enumerate(system.elastic):
            used = slice(0, 6 + elastic)
            assert np.allclose(x[b, used, q], single[b, used], rtol=1e-9, atol=1e-12 * np.abs(single).max())
        assert np.allclose(lam[..., q], multipliers, rtol=1e-9, atol=1e-12 * np.abs(multipliers).max())
