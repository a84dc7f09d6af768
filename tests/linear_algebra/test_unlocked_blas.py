"""Factors and products in place against NumPy, and in threads at once."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from calmotion.linear_algebra.unlocked_blas import add_gram, divide_right, factor_cholesky


def _matrices(seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A positive definite matrix, its factor, and a rectangle of as many columns."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((40, 60))
    gram = np.asfortranarray(root @ root.T)
    return gram, np.linalg.cholesky(gram), np.asfortranarray(rng.standard_normal((23, 40)))


def test_the_lower_triangle_becomes_the_factor() -> None:
    A, L, _ = _matrices()
    upper = np.triu(A, 1)
    assert factor_cholesky(A)
    assert np.abs(np.tril(A) - L).max() < 1e-12
    assert np.array_equal(np.triu(A, 1), upper)
    assert not factor_cholesky(np.asfortranarray(-L @ L.T))


@pytest.mark.parametrize("transposed", [False, True])
def test_the_upper_triangle_of_a_divisor_is_not_read(transposed: bool) -> None:
    _, L, B = _matrices()
    divisor = np.asfortranarray(L + np.triu(np.full(L.shape, np.nan), 1))
    wanted = B @ np.linalg.inv(L.T if transposed else L)
    divide_right(B, divisor, transposed)
    assert np.abs(B - wanted).max() < 1e-12


@pytest.mark.parametrize("lower", [False, True])
@pytest.mark.parametrize("of_columns", [False, True])
def test_one_triangle_of_a_gram_matrix_is_added(lower: bool, of_columns: bool) -> None:
    _, _, B = _matrices()
    C = np.asfortranarray(np.ones((23, 23)))
    add_gram(C, np.asfortranarray(B.T) if of_columns else B, -2.0, lower, of_columns)
    changed = np.tril(np.ones_like(C)) if lower else np.triu(np.ones_like(C))
    assert np.abs(C - (1.0 - 2.0 * changed * (B @ B.T))).max() < 1e-12


def test_what_has_no_entries_stays_as_it_is() -> None:
    C = np.asfortranarray(np.ones((3, 3)))
    add_gram(C, np.zeros((3, 0), order="F"), 1.0, True)
    divide_right(np.zeros((0, 3), order="F"), C, True)
    assert np.array_equal(C, np.ones((3, 3)))


def test_matrices_in_the_wrong_form_are_refused() -> None:
    A, L, B = _matrices()
    read_only = A.copy(order="F")
    read_only.setflags(write=False)
    for wrong in (A[:30], A.astype(np.float32), np.ascontiguousarray(B), read_only):
        with pytest.raises(ValueError, match="Fortran"):
            factor_cholesky(wrong)
    with pytest.raises(ValueError, match="do not fit"):
        divide_right(np.asfortranarray(B[:, :30]), np.asfortranarray(L), True)
    with pytest.raises(ValueError, match="do not fit"):
        add_gram(A, B, 1.0, True)


def test_threads_do_not_disturb_each_other() -> None:
    def work(seed: int) -> float:
        A, L, B = _matrices(seed)
        factor_cholesky(A)
        wanted = B @ np.linalg.inv(L.T)
        divide_right(B, A, True)
        return float(max(np.abs(np.tril(A) - L).max(), np.abs(B - wanted).max()))

    with ThreadPoolExecutor(4) as pool:
        assert max(pool.map(work, range(40))) < 1e-11
