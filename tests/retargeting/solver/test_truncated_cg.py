"""Conjugate gradients against dense solutions, and the way they keep for smaller regions."""

import numpy as np
import pytest
from calmotion.retargeting.solver.truncated_cg import conjugate_gradients


@pytest.fixture
def system():
    rng = np.random.default_rng(2)
    M = rng.normal(size=(8, 8))
    return M @ M.T + np.eye(8), rng.normal(size=8)


def solve(H, g, radius=np.inf, share=1e-14, limit=50):
    return conjugate_gradients(lambda v: H @ v, g, lambda r: r / np.diag(H), radius, share, 0.0, limit)


def test_the_end_of_the_way_is_the_minimum(system):
    H, g = system
    path = solve(H, g)
    step, decrease, length = path.within(np.inf)
    assert np.abs(H @ step + g).max() < 1e-6
    assert decrease == pytest.approx(0.5 * g @ np.linalg.solve(H, g))
    # lengths are in the preconditioner's metric
    assert length == pytest.approx(np.sqrt(step @ (np.diag(H) * step)), rel=1e-6)


def test_a_smaller_region_needs_no_product_and_predicts_what_its_step_brings(system):
    H, g = system
    path = solve(H, g)
    before = 0.0
    for share in (0.05, 0.3, 0.6, 0.9):
        step, decrease, length = path.within(share * path.length)
        assert length == share * path.length
        assert decrease == pytest.approx(-(g @ step + 0.5 * step @ H @ step))
        assert decrease > before
        before = decrease


def test_it_ends_at_the_radius_where_little_is_left_and_at_the_limit(system):
    H, g = system
    whole = solve(H, g)
    cut = solve(H, g, radius=0.5 * whole.length)
    assert len(cut.p) < len(whole.p) and cut.length >= 0.5 * whole.length
    rough = solve(H, g, share=0.1)
    _, most, _ = whole.within(np.inf)
    assert len(rough.p) < len(whole.p) and rough.within(np.inf)[1] > 0.8 * most
    assert len(solve(H, g, limit=2).p) == 2


def test_a_search_without_gain_takes_no_product(system):
    H, _ = system
    path = solve(H, np.zeros(8))
    assert len(path.p) == 0 and np.array_equal(path.within(np.inf)[0], np.zeros(8))


@pytest.fixture
def ill_conditioned():
    """A matrix with eigenvalues from 1e-4 to 1e6, as those of stiff and of nearly idle motions."""
    rng = np.random.default_rng(3)
    basis = np.linalg.qr(rng.normal(size=(200, 200)))[0]
    return basis * np.geomspace(1e-4, 1e6, 200) @ basis.T, rng.normal(size=200)


def test_rounding_does_not_grow(ill_conditioned):
    """Plain conjugate gradients differ by 1e-3 here."""
    H, g = ill_conditioned
    rng = np.random.default_rng(4)
    one = conjugate_gradients(lambda v: H @ v, g, lambda r: r, np.inf, 1e-14, 0.0, 60)
    nearly = g * (1.0 + 1e-14 * rng.normal(size=200))
    other = conjugate_gradients(lambda v: H @ v, nearly, lambda r: r, np.inf, 1e-14, 0.0, 60)
    assert len(one.p) == len(other.p) == 60
    for k in (20, 40, 60):
        assert np.abs(one.steps[k] - other.steps[k]).max() < 1e-9 * np.abs(one.steps[k]).max()


def test_directions_are_conjugate(ill_conditioned):
    H, g = ill_conditioned
    path = conjugate_gradients(lambda v: H @ v, g, lambda r: r, np.inf, 1e-14, 0.0, 60)
    gram = path.p @ path.Hp.T
    scale = np.sqrt(np.diag(gram))
    assert np.abs(gram / np.outer(scale, scale) - np.eye(60)).max() < 1e-8
