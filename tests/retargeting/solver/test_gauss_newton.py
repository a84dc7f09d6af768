"""Gauss-Newton on small problems with known Jacobians."""

from dataclasses import dataclass

import numpy as np
import pytest
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.retargeting.solver import gauss_newton
from calmotion.retargeting.solver.gauss_newton import Ends, Search, minimize
from calmotion.retargeting.solver.limited_step import LimitedStep
from calmotion.retargeting.solver.preconditioner import Sharpened
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.retargeting.solver.truncated_cg import conjugate_gradients


class Problem:
    """A nonlinear least-squares problem with a known Jacobian: r = A x + 0.1 (B x)^2 - b."""

    def __init__(self, seed=0, rows=12, columns=5, quadratic=0.1):
        rng = np.random.default_rng(seed)
        self.A, self.B = rng.normal(size=(rows, columns)), rng.normal(size=(rows, columns))
        self.b, self.quadratic = rng.normal(size=rows), quadratic
        self.calls = 0

    def residual(self, x):
        return self.A @ x + self.quadratic * (self.B @ x) ** 2 - self.b

    def jacobian(self, x):
        return self.A + 2 * self.quadratic * (self.B @ x)[:, None] * self.B

    def at(self, x, near=None):
        self.calls += 1
        return Point(self, x.copy(), 0.5 * float(np.sum(self.residual(x) ** 2)))

    def tried(self, x, near=None):
        try:
            return self.at(x, near)
        except SimulationFailure:
            return None


@dataclass(frozen=True)
class Point:
    """What is known of a problem at a point."""

    problem: Problem
    x: np.ndarray
    merit: float
    limits_act = False

    def linearized(self):
        J = self.problem.jacobian(self.x)
        return Linear(self.problem, self.x, J, J.T @ self.problem.residual(self.x))

    def gain(self, decrease):
        return decrease

    def merit_of_gain(self, gain):
        return gain

    def tightened(self):
        return None


@dataclass(frozen=True)
class Linear:
    """The derivatives there."""

    problem: Problem
    x: np.ndarray
    J: np.ndarray
    gradient: np.ndarray

    def product(self, direction):
        self.problem.products = getattr(self.problem, "products", 0) + 1
        return self.J.T @ (self.J @ direction)

    def by_responses(self, known=None):
        return None

    def patience(self, sharpened):
        known = sharpened is not None and np.array_equal(sharpened.point, self.x)
        return None if known else getattr(self.problem, "pays_from", None)

    def sharpened(self):
        return Sharpened(self.x, np.linalg.inv(self.J.T @ self.J))

    def precondition(self, fixed, sharpened=None):
        if sharpened is not None:
            return lambda r: sharpened.preconditioner @ r
        poor = hasattr(self.problem, "pays_from")
        return (lambda r: r) if poor else (lambda r: r / np.sum(self.J**2, axis=0))


class Rosenbrock(Problem):
    """r = (10 (x1 - x0^2), 1 - x0): a curved valley."""

    def residual(self, x):
        return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])

    def jacobian(self, x):
        return np.array([[-20 * x[0], 10.0], [-1.0, 0.0]])


FREE = np.zeros(5, bool)


@pytest.mark.parametrize("seed", range(5))
def test_minimum_is_stationary_and_every_iterate_is_lower(seed):
    problem = Problem(seed)
    search = minimize(problem, Search.start(np.zeros(5)), FREE, Ends(1e-14, 60))
    assert np.abs(search.at.linearized().gradient).max() < 1e-5 and search.reason == "converged"
    values = [iterate.value for iterate in search.history]
    assert all(b < a for a, b in zip(values, values[1:], strict=False))
    assert search.evaluations == problem.calls


class Saturating(Problem):
    """r = tanh(x) - 1/2 in each coordinate: far from the minimum steps are much too long."""

    def residual(self, x):
        return np.tanh(x) - 0.5

    def jacobian(self, x):
        return np.diag(1.0 / np.cosh(x) ** 2)


def test_a_small_trust_region_is_no_minimum():
    """What little is to be gained within a region that shrank says nothing of what is to be gained."""
    begin = Search(np.full(3, 1.5), 1e-9, Recycled.none(3))
    found = minimize(Saturating(), begin, np.zeros(3, bool), Ends(1e-12, 60))
    assert found.reason == "converged" and np.allclose(np.tanh(found.x), 0.5, atol=1e-5)


class Stuck(Problem):
    """Its derivative promises what no step gives."""

    def residual(self, x):
        return 1.0 + 1e-7 * np.abs(x)

    def jacobian(self, x):
        return np.ones((len(x), len(x)))


def test_a_search_that_gains_nothing_says_so():
    found = minimize(Stuck(), Search.start(np.zeros(3)), np.zeros(3, bool), Ends(1e-6))
    assert found.reason == "no further decrease"


class Flat(Problem):
    """A small part of what its derivative promises is there."""

    def residual(self, x):
        return 1.0 - 1e-4 * np.tanh(1e4 * x)

    def jacobian(self, x):
        return np.diag(-1.0 / np.cosh(1e4 * x) ** 2)


def test_where_little_is_gained_beyond_a_small_region_limits_still_come_to_act(monkeypatch):
    asked = []
    monkeypatch.setattr(Point, "tightened", lambda point: asked.append(point.x))
    found = minimize(Flat(), Search(np.zeros(1), 1e-9, Recycled.none(1)), np.zeros(1, bool), Ends(1e-3))
    assert found.reason == "no further decrease" and len(asked) == 1 and np.array_equal(asked[0], found.x)
    assert found.x[0] > 0.0


def test_a_curved_valley_is_followed_to_its_end():
    search = minimize(Rosenbrock(), Search.start(np.array([-1.2, 1.0])), np.zeros(2, bool), Ends(1e-18, 60))
    assert np.allclose(search.x, 1.0, atol=1e-6)


def test_fixed_entries_stay_and_the_others_are_optimal():
    problem = Problem(3)
    fixed = np.array([False, True, False, False, True])
    start = np.array([0.0, 0.3, 0.0, 0.0, -0.2])
    search = minimize(problem, Search.start(start), fixed, Ends(1e-14, 60))
    assert np.array_equal(search.x[fixed], start[fixed])
    assert np.abs(search.at.linearized().gradient[~fixed]).max() < 1e-5


def test_a_search_resumes_from_any_iterate_with_the_same_result():
    kept = []
    whole = minimize(
        Rosenbrock(), Search.start(np.array([-1.2, 1.0])), np.zeros(2, bool), Ends(1e-18), on_iterate=kept.append
    )
    for search in kept[::3]:
        again = minimize(Rosenbrock(), search, np.zeros(2, bool), Ends(1e-18))
        assert np.array_equal(again.x, whole.x) and len(again.history) == len(whole.history)


def test_the_expected_gain_at_the_end_is_below_the_requested_gain():
    search = minimize(Problem(1), Search.start(np.zeros(5)), FREE, Ends(1e-3))
    assert search.reason == "converged" and 0.0 <= search.history[-1].gain < 1e-3


def test_points_that_cannot_be_evaluated_are_kept_away_from():
    class Walled(Problem):
        def at(self, x, near=None):
            if np.linalg.norm(x) > 0.2:
                raise SimulationFailure(0.0, 0, Reason.SINGULAR)
            return super().at(x, near)

    search = minimize(Walled(2), Search.start(np.zeros(5)), FREE, Ends(1e-12, 40))
    assert np.isfinite(search.history[-1].value) and np.linalg.norm(search.x) <= 0.2


def test_products_of_one_system_precondition_the_next():
    rng = np.random.default_rng(4)
    M = rng.normal(size=(30, 30))
    H = M @ M.T + 0.1 * np.eye(30)
    g = rng.normal(size=30)
    first = conjugate_gradients(lambda d: H @ d, g, lambda r: r, np.inf, 1e-12, 0.0, 40)
    learned = Recycled.none(30).followed_by(first.p, first.Hp, 24)
    inverse = learned.inverse(lambda r: r)
    dense = np.column_stack([inverse(e) for e in np.eye(30)])
    assert np.allclose(dense, dense.T, atol=1e-8 * np.abs(dense).max()) and np.linalg.eigvalsh(dense).min() > 0.0
    second = conjugate_gradients(lambda d: (H + 1e-3 * np.eye(30)) @ d, g, inverse, np.inf, 1e-6, 0.0, 40)
    assert len(second.p) < 0.7 * len(first.p)


class Poor(Problem):
    """A problem whose first preconditioner is poor, and that can be preconditioned with its matrix at a point."""

    def __init__(self, pays_from, rows=60, columns=40):
        super().__init__(7, rows, columns, 0.02)
        self.b *= 3.0
        self.A *= np.geomspace(1.0, 30.0, columns)
        self.pays_from = pays_from


def test_a_better_preconditioner_is_made_where_systems_take_long():
    fixed, start = np.zeros(40, bool), Search.start(np.zeros(40))
    plain, sharpened = Poor(None), Poor(8)
    before, after = (minimize(problem, start, fixed, Ends(1e-9)) for problem in (plain, sharpened))
    assert after.reason == before.reason == "converged"
    assert np.allclose(after.x, before.x, atol=1e-4) and after.products < 0.7 * before.products
    assert before.sharpened is None and len(after.sharpened.point) == 40


@dataclass(frozen=True)
class Limited(Point):
    """A point under limits, which the steps of `Promised` keep."""

    limits_act = True

    def with_limits(self, limits):
        return self


class Promised(Problem):
    """A problem under limits that is far more curved than its derivatives tell: steps have to be a share of them."""

    def at(self, x, near=None):
        self.calls += 1
        return Limited(self, x.copy(), 0.5 * float(np.sum(self.residual(x) ** 2)))

    def step(self, linear, *rest):
        step = np.linalg.lstsq(linear.J, -self.residual(linear.x), rcond=None)[0]
        promised = 0.5 * float(np.sum((linear.J @ step) ** 2))
        return LimitedStep(self.longer * step, 1, lambda t: t * (2.0 - t) * promised, promised, None)


def under_limits(monkeypatch, longer, gain, at_most=60):
    problem = Promised(1)
    problem.longer = longer
    monkeypatch.setattr(gauss_newton, "limited_step", problem.step)
    return minimize(problem, Search.start(np.zeros(5)), FREE, Ends(gain, at_most))


def test_a_step_under_limits_begins_with_the_share_that_the_last_one_had(monkeypatch):
    search = under_limits(monkeypatch, 20.0, 1e-3)
    tried = np.diff([iterate.evaluations for iterate in search.history])
    assert tried[0] >= 3 and np.mean(tried[1:]) < 2.5, tried


def test_steps_under_limits_that_bring_less_than_they_promise_end_a_search(monkeypatch):
    gain = 1e-3
    few = under_limits(monkeypatch, 0.03, gain, 400)
    brought = -np.diff([iterate.value for iterate in few.history])
    assert few.reason == "no further decrease"
    assert all(iterate.gain >= gain for iterate in few.history[-3:]) and brought[-2:].max() < gain <= brought[-4]


@dataclass(frozen=True)
class Bounded(Point):
    """A point whose limits come to act at the minimum without them, and are then exceeded as far as it is from zero."""

    limits_act: bool = False

    def of(self, problem):
        exceeded = self.problem.costs * float(self.x @ self.x)
        return Bounded(problem, self.x, 0.5 * float(np.sum(problem.residual(self.x) ** 2)) + exceeded, True)

    def tightened(self):
        return None if self.limits_act else self.of(self.problem)


class Exceeding(Problem):
    """A problem under limits from which no step leads."""

    def at(self, x, near=None):
        return Bounded(self, x.copy(), 0.5 * float(np.sum(self.residual(x) ** 2)))


@pytest.mark.parametrize("costs, goes_on_from", [(0.0, "the minimum"), (100.0, "the start")])
def test_limits_come_to_act_where_the_merit_with_them_is_least(monkeypatch, costs, goes_on_from):
    problem, seen = Exceeding(1), []

    def step(linear, *rest):
        seen.append(linear.x)
        return LimitedStep(np.zeros(5), 0, lambda t: 0.0, 0.0, None)

    problem.costs = costs
    monkeypatch.setattr(gauss_newton, "limited_step", step)
    monkeypatch.setattr(Bounded, "with_limits", lambda at, limits: at, raising=False)
    start = np.full(5, 0.01)
    minimize(problem, Search.start(start), FREE, Ends(1e-6), onto_limits=lambda at: (problem, at.x))
    assert np.array_equal(seen[0], start) == (goes_on_from == "the start")
