"""The smallest largest error of linear models, against linear programs and differences."""

import numpy as np
import pytest
from calmotion.retargeting.robust.least_maximum import ORDERS, least_maximum
from calmotion.retargeting.robust.linear_errors import LinearErrors, lengths, norm_of, weights_of
from scipy.optimize import linprog


class Quadratic:
    """A rest that is a multiple of half the squared change."""

    def __init__(self, weight):
        self.weight = weight

    def value(self, d):
        return 0.5 * self.weight * float(d @ d)

    def derivatives(self, d):
        return self.weight * d, self.weight * np.eye(len(d))


def straight(robots, instants, unknowns, seed=0):
    """Errors along one axis: the largest length is the largest absolute value."""
    rng = np.random.default_rng(seed)
    errors, changes = np.zeros((robots, instants, 1, 3)), np.zeros((robots, instants, 1, 3, unknowns), np.float32)
    errors[..., 0] = rng.normal(size=(robots, instants, 1))
    changes[..., 0, :] = rng.normal(size=(robots, instants, 1, unknowns))
    return LinearErrors.of(errors, changes, 1.0)


def smallest(linear, factors):
    """The least maximum by a linear program."""
    J, r = linear.changes[..., 0, :].reshape(-1, linear.changes.shape[-1]).astype(float), linear.errors[..., 0].ravel()
    f = np.repeat(factors.ravel(), linear.errors.shape[1])
    rows = np.vstack([np.c_[f[:, None] * J, -np.ones(len(f))], np.c_[-f[:, None] * J, -np.ones(len(f))]])
    found = linprog(
        np.r_[np.zeros(J.shape[1]), 1.0], rows, np.r_[-f * r, f * r], bounds=[(None, None)] * (J.shape[1] + 1)
    )
    return found.fun


@pytest.mark.parametrize("factor", [1.0, 4.0])
def test_it_is_near_the_least_maximum_of_a_linear_program(factor):
    linear, factors = straight(3, 40, 8), np.array([[factor], [1.0], [1.0]])
    found = least_maximum(linear, factors, Quadratic(1e-9), np.zeros(8, bool), np.zeros(8), (4, 8, 16, 32, 64))
    largest, least = lengths(linear.at(found), factors).max(), smallest(linear, factors)
    assert least <= largest * (1.0 + 1e-6) and largest < 1.06 * least
    squares = least_maximum(linear, factors, Quadratic(1e-9), np.zeros(8, bool), np.zeros(8), (2,))
    assert lengths(linear.at(squares), factors).max() > 1.15 * least


def test_a_sum_of_squares_with_its_weights_is_smallest_there_too():
    rng = np.random.default_rng(1)
    linear = LinearErrors.of(rng.normal(size=(2, 30, 2, 3)), rng.normal(size=(2, 30, 2, 3, 6)).astype(np.float32), 1.0)
    factors, rest = np.array([[2.0, 1.0], [1.0, 1.0]]), Quadratic(1e-6)
    found = least_maximum(linear, factors, rest, np.zeros(6, bool), np.zeros(6))
    errors = linear.at(found)
    weights = weights_of(lengths(errors, factors), factors, ORDERS[-1])
    roots = np.sqrt(weights / weights.size)[..., None]
    rows = (roots[..., None] * linear.changes).reshape(-1, 6)
    other = found - np.linalg.solve(rows.T @ rows, rows.T @ (roots * errors).ravel())
    assert np.linalg.norm(other - found) < 0.05 * np.linalg.norm(found)


def test_errors_that_no_unknown_changes_stay_as_they_are():
    linear = LinearErrors.of(np.ones((2, 5, 1, 3)), np.zeros((2, 5, 1, 3, 4), np.float32), 1.0)
    found = least_maximum(linear, np.ones((2, 1)), Quadratic(0.0), np.zeros(4, bool), np.zeros(4))
    assert np.array_equal(found, np.zeros(4))


def test_fixed_unknowns_do_not_change_and_norms_grow_to_the_largest():
    linear, factors, fixed = straight(2, 20, 5), np.ones((2, 1)), np.array([True, False, False, True, False])
    found = least_maximum(linear, factors, Quadratic(1e-9), fixed, np.zeros(5))
    assert np.all(found[fixed] == 0.0) and np.all(found[~fixed] != 0.0)
    m = lengths(linear.at(found), factors)
    norms = [norm_of(m, order) for order in (2, 4, 16, 64)]
    assert norms == sorted(norms) and norms[-1] <= m.max()
    assert norm_of(np.zeros(3), 4) == 0.0
