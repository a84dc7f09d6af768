"""A preconditioner with few stiff rows against the inverse of the sum."""

import numpy as np
import pytest
from calmotion.retargeting.solver.few_rows import with_rows


@pytest.mark.parametrize("weight", [1e-3, 1.0, 1e9])
def test_it_inverts_the_sum(weight):
    rng = np.random.default_rng(0)
    P, rows = rng.normal(size=(12, 12)), rng.normal(size=(3, 12))
    P, weights = P @ P.T + np.eye(12), weight * np.array([1.0, 2.0, 3.0])
    b = rng.normal(size=12)
    expected = np.linalg.solve(P + rows.T @ (weights[:, None] * rows), b)
    found = with_rows(lambda x: np.linalg.solve(P, x), rows, weights)(b)
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("weight", [1e8, 1e20])
def test_rows_that_say_the_same_and_none_at_all(weight):
    row = np.array([[1.0, 2.0, 0.0]])
    found = with_rows(lambda x: x, np.concatenate([row, row]), np.array([weight, weight]))(np.ones(3))
    assert found == pytest.approx(np.array([0.4, -0.2, 1.0]), abs=1e-6)  # what is left beside the row
    inverse = np.negative
    assert with_rows(inverse, np.zeros((0, 3)), np.zeros(0)) is inverse
