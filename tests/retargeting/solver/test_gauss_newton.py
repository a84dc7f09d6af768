"""Gauss-Newton on small problems with known Jacobians."""

import numpy as np
import pytest
from calmotion.retargeting.solver.gauss_newton import Search, minimize
from calmotion.retargeting.solver.recycling import Recycled


class Problem:
    """A nonlinear least-squares problem with a known Jacobian: r = A x + 0.1 (B x)^2 - b."""

    limits_act = False
    patience = None
    sharpened_at = np.zeros(0)

    def __init__(self, seed=0, rows=12, columns=5, quadratic=0.1):
        rng = np.random.default_rng(seed)
        self.A, self.B = rng.normal(size=(rows, columns)), rng.normal(size=(rows, columns))
        self.b, self.quadratic = rng.normal(size=rows), quadratic
        self.calls = 0

    def residual(self, x):
        return self.A @ x + self.quadratic * (self.B @ x) ** 2 - self.b

    def value(self, x):
        self.x = x.copy()
        self.calls += 1
        return 0.5 * float(np.sum(self.residual(x) ** 2))

    def linearize(self):
        self.J = self.A + 2 * self.quadratic * (self.B @ self.x)[:, None] * self.B
        return self.J.T @ self.residual(self.x)

    def product(self, direction):
        return self.J.T @ (self.J @ direction)

    def precondition(self, fixed):
        return lambda r: r / np.sum(self.J**2, axis=0)

    def gain(self, decrease, value):
        return decrease

    def merit_of_gain(self, gain):
        return gain

    def tighten(self):
        return False


class Rosenbrock(Problem):
    """r = (10 (x1 - x0^2), 1 - x0): a curved valley."""

    def residual(self, x):
        return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])

    def linearize(self):
        self.J = np.array([[-20 * self.x[0], 10.0], [-1.0, 0.0]])
        return self.J.T @ self.residual(self.x)


FREE = np.zeros(5, bool)


@pytest.mark.parametrize("seed", range(5))
def test_minimum_is_stationary_and_every_iterate_is_lower(seed):
    problem = Problem(seed)
    search = minimize(problem, Search.start(np.zeros(5)), FREE, 1e-14, max_iterations=60)
    problem.value(search.x)
    assert np.abs(problem.linearize()).max() < 1e-5 and search.reason == "converged"
    values = [iterate.value for iterate in search.history]
    assert all(b < a for a, b in zip(values, values[1:], strict=False))
    assert search.evaluations == problem.calls - 1


def test_a_curved_valley_is_followed_to_its_end():
    search = minimize(Rosenbrock(), Search.start(np.array([-1.2, 1.0])), np.zeros(2, bool), 1e-18, max_iterations=60)
    assert np.allclose(search.x, 1.0, atol=1e-6)


def test_fixed_entries_stay_and_the_others_are_optimal():
    problem = Problem(3)
    fixed = np.array([False, True, False, False, True])
    start = np.array([0.0, 0.3, 0.0, 0.0, -0.2])
    search = minimize(problem, Search.start(start), fixed, 1e-14, max_iterations=60)
    assert np.array_equal(search.x[fixed], start[fixed])
    problem.value(search.x)
    assert np.abs(problem.linearize()[~fixed]).max() < 1e-5


def test_a_search_resumes_from_any_iterate_with_the_same_result():
    kept = []
    whole = minimize(
        Rosenbrock(), Search.start(np.array([-1.2, 1.0])), np.zeros(2, bool), 1e-18, on_iterate=kept.append
    )
    for search in kept[::3]:
        again = minimize(Rosenbrock(), search, np.zeros(2, bool), 1e-18)
        assert np.array_equal(again.x, whole.x) and len(again.history) == len(whole.history)


def test_the_expected_gain_at_the_end_is_below_the_requested_gain():
    search = minimize(Problem(1), Search.start(np.zeros(5)), FREE, 1e-3)
    assert search.reason == "converged" and 0.0 <= search.history[-1].gain < 1e-3


def test_points_that_cannot_be_evaluated_are_kept_away_from():
    class Walled(Problem):
        def value(self, x):
            value = super().value(x)
            return np.inf if np.linalg.norm(x) > 0.2 else value

    search = minimize(Walled(2), Search.start(np.zeros(5)), FREE, 1e-12, max_iterations=40)
    assert np.isfinite(search.history[-1].value) and np.linalg.norm(search.x) <= 0.2


def test_products_of_one_system_precondition_the_next():
    rng = np.random.default_rng(4)
    M = rng.normal(size=(30, 30))
    H = M @ M.T + 0.1 * np.eye(30)
    from calmotion.retargeting.solver.truncated_cg import conjugate_gradients

    g = rng.normal(size=30)
    first = conjugate_gradients(lambda d: H @ d, g, lambda r: r, np.inf, 1e-12, 0.0, 40)
    learned = Recycled.none(30).followed_by(first.p, first.Hp, 24)
    inverse = learned.inverse(lambda r: r)
    dense = np.column_stack([inverse(e) for e in np.eye(30)])
    assert np.allclose(dense, dense.T, atol=1e-8 * np.abs(dense).max()) and np.linalg.eigvalsh(dense).min() > 0.0
    second = conjugate_gradients(lambda d: (H + 1e-3 * np.eye(30)) @ d, g, inverse, np.inf, 1e-6, 0.0, 40)
    assert len(second.p) < 0.7 * len(first.p)


class Sharpened(Problem):
    """A problem whose first preconditioner is poor, and that can be preconditioned with its matrix at a point."""

    def __init__(self, pays_from, rows=60, columns=40):
        super().__init__(7, rows, columns, 0.02)
        self.b *= 3.0
        self.A *= np.geomspace(1.0, 30.0, columns)
        self.pays_from, self.inverse, self.sharpened_at, self.products = pays_from, None, np.zeros(0), 0

    @property
    def patience(self):
        return None if np.array_equal(self.sharpened_at, self.x) else self.pays_from

    def sharpen(self):
        self.inverse, self.sharpened_at = np.linalg.inv(self.J.T @ self.J), self.x

    def product(self, direction):
        self.products += 1
        return super().product(direction)

    def precondition(self, fixed):
        return (lambda r: r) if self.inverse is None else (lambda r: self.inverse @ r)


def test_a_better_preconditioner_is_made_where_systems_take_long():
    fixed, start = np.zeros(40, bool), Search.start(np.zeros(40))
    plain, sharpened = Sharpened(None), Sharpened(8)
    before, after = (minimize(problem, start, fixed, 1e-9) for problem in (plain, sharpened))
    assert after.reason == before.reason == "converged"
    assert np.allclose(after.x, before.x, atol=1e-4) and after.products < 0.7 * before.products
    assert len(before.sharpened) == 0 and np.array_equal(after.sharpened, sharpened.sharpened_at)


def test_a_sharpened_search_resumes_with_the_same_result():
    fixed, kept = np.zeros(40, bool), []
    whole = minimize(Sharpened(8), Search.start(np.zeros(40)), fixed, 1e-9, on_iterate=kept.append)
    assert any(len(search.sharpened) for search in kept)
    for search in kept:
        again = minimize(Sharpened(8), search, fixed, 1e-9)
        assert np.array_equal(again.x, whole.x) and len(again.history) == len(whole.history)
