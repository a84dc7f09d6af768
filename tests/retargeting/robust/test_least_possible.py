"""The bound of the largest error of linear models, against linear programs."""

from types import SimpleNamespace

import numpy as np
import pytest
from calmotion.retargeting.robust import least_possible as module
from calmotion.retargeting.robust.least_maximum import least_maximum
from calmotion.retargeting.robust.least_possible import ORDERS, STEPS, EvenErrors, least_possible
from calmotion.retargeting.robust.linear_errors import LinearErrors, lengths
from scipy.optimize import linprog
from scipy.sparse import identity

ROBOTS, INSTANTS, UNKNOWNS = 3, 40, 8
FAR = np.array([9.0])  # what the nominal robot may have where that is more than anything


class Limits:
    """Limits rows @ d <= most of a rest, as one term of an augmented Lagrangian without multipliers."""

    def __init__(self, rows, most, penalty=1e3):
        self.space = SimpleNamespace(motors=[0], basis=SimpleNamespace(closeness=identity(UNKNOWNS, format="csr")))
        self.rows, self.most, self.penalty = rows, most, penalty

    def _over(self, d):
        return np.maximum(self.rows @ d - self.most, 0.0)

    def value(self, d):
        return 0.5 * self.penalty * float(np.sum(self._over(d) ** 2))

    def derivatives(self, d):
        acting = self.rows[self._over(d) > 0.0]
        return self.penalty * self.rows.T @ self._over(d), self.penalty * acting.T @ acting

    def multiplied(self, d):
        return self.penalty * float(self._over(d) @ (self.rows @ d - self.most)), self.derivatives(d)[0]


def straight(seed=0):
    """Errors along one axis: the largest length is the largest absolute value."""
    rng = np.random.default_rng(seed)
    shape = (ROBOTS, INSTANTS, 1, 3)
    errors, changes = np.zeros(shape), np.zeros((*shape, UNKNOWNS), np.float32)
    errors[..., 0] = rng.normal(size=shape[:3])
    changes[..., 0, :] = rng.normal(size=(*shape[:3], UNKNOWNS))
    return LinearErrors.of(errors, changes, 1.0)


def even_of(linear, limits):
    flat = linear.changes.reshape(-1, UNKNOWNS).astype(float)
    share = 3.0 / linear.errors.size
    slope, constant = flat.T @ linear.errors.ravel(), 0.5 * np.sum(linear.errors**2)
    return EvenErrors(limits, share * flat.T @ flat, share * slope, share * constant)


def smallest(linear, limits, most):
    """The least maximum of all robots by a linear program, with the nominal one within what it may have."""
    J, r = linear.changes[..., 0, :].reshape(-1, UNKNOWNS).astype(float), linear.errors[..., 0].ravel()
    v, own = np.ones((len(r), 1)), slice(0, INSTANTS)
    rows = np.vstack([np.c_[J, -v], np.c_[-J, -v], *(np.c_[s * J[own], 0.0 * v[own]] for s in (1, -1))])
    right = np.r_[-r, r, most - r[own], most + r[own]]
    found = linprog(
        np.r_[np.zeros(UNKNOWNS), 1.0], np.vstack([rows, np.c_[limits.rows, np.zeros(len(limits.rows))]]),
        np.r_[right, limits.most], bounds=[(None, None)] * (UNKNOWNS + 1),
    )  # fmt: skip
    return found.fun


FREE = Limits(np.zeros((0, UNKNOWNS)), np.zeros(0))


def narrow(seed=0):
    return Limits(np.random.default_rng(seed + 100).normal(size=(12, UNKNOWNS)), np.full(12, 0.05))


def bounded(linear, limits, most, factor, fixed=None, steps=STEPS):
    factors = np.ones((ROBOTS, 1))
    factors[0] = factor
    fixed = np.zeros(UNKNOWNS, bool) if fixed is None else fixed
    even = even_of(linear, limits)
    d = least_maximum(linear, factors, even, fixed, np.zeros(UNKNOWNS), ORDERS, steps)
    return least_possible(linear, factors, most, even, fixed, d, 10.0), d, factors


@pytest.mark.parametrize("limits", [FREE, narrow()], ids=["free", "limited"])
def test_it_is_a_little_below_the_least_maximum_of_a_linear_program(limits):
    linear = straight()
    least = smallest(linear, limits, FAR)
    bound, d, factors = bounded(linear, limits, FAR, 1.0)
    assert lengths(linear.at(d), factors).max() > 0.999 * least  # the linear program is that of these errors
    assert 0.98 * least < bound < least


def test_limits_and_what_the_nominal_robot_may_have_raise_it():
    linear, most = straight(), np.array([1.2])
    free, least = bounded(linear, FREE, FAR, 1.0)[0], smallest(linear, FREE, most)
    assert bounded(linear, narrow(), FAR, 1.0)[0] > 1.05 * free
    held = [bounded(linear, FREE, most, factor)[0] for factor in (1.3, 1.5, 1.6)]
    assert 1.05 * free < 0.98 * least < max(held) < least


@pytest.mark.parametrize("seed", range(6))
def test_weights_that_are_not_the_best_give_bounds_that_hold(seed):
    linear, rng, fixed = straight(seed), np.random.default_rng(seed), np.zeros(UNKNOWNS, bool)
    most = np.array([0.9 * np.abs(linear.errors[0]).max()])
    even, least, told = even_of(linear, FREE), smallest(linear, FREE, most), 0
    for factor in (1.0, 1.25, 1.5, 2.0):
        _, d, factors = bounded(linear, FREE, most, factor)
        for size in (0.0, 1e-3, 1e-2):
            there = d + size * rng.normal(size=UNKNOWNS)
            bound = least_possible(linear, factors, most, even, fixed, there, 10.0)
            assert bound < least
            told += bound > 0.5 * least
    assert told > 1


def test_fixed_unknowns_raise_it():
    linear, fixed = straight(), np.arange(UNKNOWNS) < 4
    assert bounded(linear, FREE, FAR, 1.0, fixed)[0] > 1.1 * bounded(linear, FREE, FAR, 1.0)[0]


def test_errors_that_curves_can_change_at_will_have_none():
    linear = straight()
    few = LinearErrors.of(linear.errors[:, :1], linear.changes[:, :1], 1.0)
    assert bounded(few, FREE, FAR, 1.0)[0] < 1e-2 * np.abs(few.errors).max()


def test_the_even_part_is_that_of_all_errors():
    linear, d = straight(), np.random.default_rng(3).normal(size=UNKNOWNS)
    even = even_of(linear, FREE)
    assert even.squares(d) == pytest.approx(0.5 * np.mean(np.sum(linear.at(d) ** 2, axis=3)), rel=1e-6)
    step = 1e-6
    slopes = [(even.value(d + step * u) - even.value(d - step * u)) / (2 * step) for u in np.eye(UNKNOWNS)]
    assert np.allclose(even.derivatives(d)[0], slopes, rtol=1e-5)
    assert np.allclose(even.derivatives(d)[1], module._EVEN * even.gram)
