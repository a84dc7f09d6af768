"""Power means of errors that are linear in the unknowns, and those of them that count."""

import numpy as np
import pytest
from calmotion.retargeting.robust.linear_errors import FewErrors, LinearErrors, lengths, merit


def drawn(instants, seed=2):
    """Errors of two robots at two targets, by four unknowns."""
    rng = np.random.default_rng(seed)
    shape = (2, instants, 2, 3)
    return LinearErrors.of(rng.normal(size=shape), rng.normal(size=(*shape, 4)).astype(np.float32), 3.0)


FACTORS = np.array([[2.0, 1.0], [1.0, 0.5]])


def test_derivatives_of_those_that_count_are_differences_of_the_merit_of_all():
    linear, d = drawn(10), np.random.default_rng(3).normal(size=4)

    def value(x):
        errors = linear.errors + linear.changes.astype(float) @ x
        return merit(linear.scale, lengths(errors, FACTORS), 8, 0.15 * float(x @ x))

    few = FewErrors.of(linear, linear.at(d), FACTORS, 8)
    gradient, matrix = few.derivatives(few.errors, (0.3 * d, 0.3 * np.eye(4)))
    steps = 1e-6 * np.eye(4)
    differences = [(value(d + s) - value(d - s)) / 2e-6 for s in steps]
    assert np.allclose(gradient, differences, rtol=2e-3)
    assert np.linalg.eigvalsh(matrix).min() > 0.0


@pytest.mark.parametrize("order", [8, 16])
def test_few_errors_have_the_power_mean_of_all(order):
    linear = drawn(200)
    few = FewErrors.of(linear, linear.errors, FACTORS, order)
    assert 0 < len(few.errors) < 0.8 * few.some.size
    every = merit(linear.scale, lengths(linear.errors, FACTORS), order, 0.5)
    assert few.merit(few.errors, 0.5) == pytest.approx(every, rel=1e-3)
    d = np.random.default_rng(4).normal(size=4)
    assert np.allclose(few.errors + few.moved(d), linear.at(d)[few.some], rtol=1e-5)


def test_errors_that_were_left_out_count_once_they_are_larger():
    linear = drawn(50)
    errors = linear.errors.copy()
    errors[0, 7] *= 1e-3
    few = FewErrors.of(linear, errors, FACTORS, 16)
    assert not few.some[0, 7].any() and few.are_all(errors, FACTORS)
    grown = 0.5 * errors
    grown[0, 7, 0] = 10.0
    assert not few.are_all(grown, FACTORS)
    more = few.with_further(linear, grown, FACTORS)
    assert np.all(more.some[few.some]) and more.some[0, 7, 0] and more.are_all(grown, FACTORS)
    assert np.array_equal(more.errors, grown[more.some])
