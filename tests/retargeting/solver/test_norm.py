"""Power means of errors and their derivatives."""

import numpy as np
import pytest
from calmotion.retargeting.solver.norm import PowerMean, SumOfSquares

INSTANTS, ERRORS, FURTHER = 7, 4, 2


def mean(order, factors=1.0):
    """Of errors at instants of different weights, the last of which does not count."""
    steps = np.array([0.5, 1.0, 1.0, 2.0, 1.0, 0.5, 0.0])[:, None]
    units = np.sqrt(np.where(steps > 0.0, 3.0 * steps, np.inf))
    return PowerMean(order, units, steps / (ERRORS * steps.sum()), factors * np.ones((INSTANTS, ERRORS)))


@pytest.fixture
def residuals():
    found = np.random.default_rng(1).normal(size=(INSTANTS, 3 * ERRORS + FURTHER))
    found[-1, : 3 * ERRORS] = 0.0
    found[0, :3] = 0.0
    return found


@pytest.mark.parametrize("order", [2, 4, 8, 16])
def test_derivatives_are_those_of_differences(residuals, order):
    norm, e = mean(order, np.linspace(1.0, 3.0, ERRORS)), 1e-6
    change = np.random.default_rng(2).normal(size=residuals.shape)
    slope = (norm.value(residuals + e * change) - norm.value(residuals - e * change)) / (2.0 * e)
    assert np.sum(norm.gradient(residuals) * change) == pytest.approx(slope, rel=1e-7)
    difference = (norm.gradient(residuals + e * change) - norm.gradient(residuals - e * change)) / (2.0 * e)
    counted = norm.lengths(residuals) > 0.0
    product = norm.product(residuals, change)
    of_errors = slice(0, 3 * ERRORS)
    own, other = (v[:, of_errors].reshape(INSTANTS, ERRORS, 3)[counted] for v in (product, difference))
    assert np.allclose(own, other, rtol=1e-5, atol=1e-7 * np.abs(other).max())
    assert np.array_equal(product[:, 3 * ERRORS :], change[:, 3 * ERRORS :])


def test_of_order_two_it_is_the_sum_of_squares(residuals):
    assert mean(2).value(residuals) == pytest.approx(SumOfSquares().value(residuals), rel=1e-12)
    assert np.allclose(mean(2).gradient(residuals), SumOfSquares().gradient(residuals))


def test_of_high_order_it_is_the_largest_error(residuals):
    largest = mean(2).lengths(residuals).max()
    means = [np.sqrt(2.0 * mean(p).value(residuals[:, : 3 * ERRORS])) for p in (4, 16, 400)]
    total = np.sqrt(3.0 * 6.0 * ERRORS)  # the sum of the squared units
    assert means[0] < means[1] < means[2] < total * largest and means[2] > 0.98 * total * largest


def test_roots_and_what_is_common_are_the_second_derivatives(residuals):
    norm, change = mean(8), np.random.default_rng(3).normal(size=residuals.shape)
    change[:, 3 * ERRORS :] = 0.0
    roots = norm.roots(residuals)
    squared = np.einsum("eij,ejk,ek->ei", roots, roots, change[:, : 3 * ERRORS].reshape(-1, 3))
    common, share = norm.lessened(residuals)
    expected = squared.reshape(INSTANTS, -1) - share * np.sum(common * change) * common[:, : 3 * ERRORS]
    assert np.allclose(norm.product(residuals, change)[:, : 3 * ERRORS], expected)
    assert np.sum(change * norm.product(residuals, change)) > 0.0


def test_no_error_at_all_has_no_weight():
    still = np.zeros((INSTANTS, 3 * ERRORS))
    norm = mean(16)
    assert norm.value(still) == 0.0 and not np.any(norm.gradient(still))
    assert np.all(np.isfinite(norm.product(still, np.ones_like(still))))
