"""The least-squares search, against linear algebra and known minima."""

import dataclasses

import numpy as np
import pytest
from calmotion_plugins.calibration.identification.least_squares import (
    Solution,
    chord,
    minimize,
    posterior,
)

FREE = np.full(2, -np.inf)


class Linear:
    """Residuals A z - b."""

    def __init__(self, A, b):
        self.A, self.b, self.counts = A, b, np.ones(len(b))

    def residuals(self, z):
        return self.A @ z - self.b

    def linearized(self, z):
        return self.residuals(z), self.A


class Exponential:
    """A decaying oscillation of unknown rate and frequency, sampled with an exact derivative."""

    times, counts = np.linspace(0.0, 2.0, 200), np.ones(200)

    def __init__(self, truth, sigma=1e-3, failing=False):
        self.sigma, self.failing = sigma, failing
        self.measured = self.signal(np.array(truth))

    def signal(self, z):
        return np.exp(-(1.0 + z[0]) * self.times) * np.sin((6.0 + z[1]) * self.times)

    def residuals(self, z):
        return None if self.failing and z[1] > 0.6 else (self.signal(z) - self.measured) / self.sigma

    def linearized(self, z):
        t = self.times
        envelope = np.exp(-(1.0 + z[0]) * t)
        by_rate, by_frequency = -t * self.signal(z), envelope * t * np.cos((6.0 + z[1]) * t)
        return self.residuals(z), np.stack([by_rate, by_frequency], axis=1) / self.sigma


def test_a_linear_problem_has_the_minimum_and_covariance_of_its_normal_equations():
    rng = np.random.default_rng(0)
    A, b = rng.standard_normal((30, 2)), 0.5 * rng.standard_normal(30)
    found = minimize(Linear(A, b), np.zeros(2), FREE)
    H = A.T @ A + np.eye(2)
    assert found.converged and found.z == pytest.approx(np.linalg.solve(H, A.T @ b), abs=2e-3)
    assert np.allclose(posterior(A, np.zeros(30), np.ones(30)), np.linalg.inv(H))
    assert np.allclose(posterior(A, np.ones(30), np.ones(30)), np.linalg.inv(H))
    # residuals of which four count as one tell a quarter
    assert np.allclose(posterior(A, np.zeros(30), np.full(30, 4.0)), np.linalg.inv(A.T @ A / 4.0 + np.eye(2)))


def test_deviations_are_those_of_repeated_experiments_also_where_the_noise_is_not_as_assumed():
    """The noise is three times as large where the second parameter is told."""
    rng, columns = np.random.default_rng(3), np.zeros((400, 2))
    columns[:200, 0], columns[200:, 1] = 1.0, 1.0
    found = []
    for _ in range(400):
        noise = rng.standard_normal(400) * np.where(np.arange(400) < 200, 1.0, 3.0)
        solution = minimize(Linear(columns, noise), np.zeros(2), FREE)
        found.append((solution.z, np.sqrt(np.diag(posterior(columns, solution.residuals, np.ones(400))))))
    spread = np.std([z for z, _ in found], axis=0)
    told = np.mean([deviation for _, deviation in found], axis=0)
    assert spread[1] > 2.0 * spread[0]
    assert told == pytest.approx(spread, rel=0.1)


def test_residuals_of_which_many_count_as_one_do_not_outweigh_the_prior():
    """A constant that is one, in 100 residuals of deviation 1 that are all the same."""
    problem = Linear(np.ones((100, 1)), np.ones(100))
    assert minimize(problem, np.zeros(1), FREE[:1]).z == pytest.approx(100.0 / 101.0, abs=1e-3)
    problem.counts = np.full(100, 100.0)
    assert minimize(problem, np.zeros(1), FREE[:1]).z == pytest.approx(0.5, abs=1e-3)


def test_a_nonlinear_problem_is_solved_also_where_steps_fail():
    for failing in (False, True):
        found = minimize(Exponential((0.3, 0.5), failing=failing), np.zeros(2), FREE)
        assert found.converged and found.z == pytest.approx([0.3, 0.5], abs=3e-4)


def test_outliers_hardly_move_the_minimum():
    problem = Exponential((0.3, 0.5), sigma=1e-2)
    rng = np.random.default_rng(1)
    problem.measured = problem.measured + 1e-2 * rng.standard_normal(200)
    clean = minimize(problem, np.zeros(2), FREE).z
    problem.measured[::40] += 1.0
    deviations = np.sqrt(np.diag(posterior(problem.linearized(clean)[1], np.zeros(200), np.ones(200))))
    assert np.all(np.abs(minimize(problem, np.zeros(2), FREE).z - clean) < 2.5 * deviations)


def test_bounds_hold_an_entry_that_would_leave():
    A, b = np.eye(2), np.array([-3.0, 2.0])
    found = minimize(Linear(A, b), np.zeros(2), np.array([0.0, -np.inf]))
    assert found.converged and found.z == pytest.approx([0.0, 1.0], abs=2e-2)


def test_a_chord_reaches_a_near_minimum_with_other_derivatives():
    known = minimize(Exponential((0.3, 0.5)), np.zeros(2), FREE)
    near = chord(Exponential((0.302, 0.504)), known)
    assert near.z == pytest.approx([0.302, 0.504], abs=2e-5)
    # derivatives that lead astray and steps without an end give none
    assert chord(Exponential((0.4, 0.6)), known) is not None
    assert chord(Exponential((0.4, 0.6)), dataclasses.replace(known, jacobian=-known.jacobian)) is None
    assert chord(Exponential((0.4, 0.6)), known, most=1) is None
    nowhere = Solution(np.array([0.0, 1.0]), np.zeros(200), known.jacobian, 0.0, 1, True)
    assert chord(Exponential((0.3, 0.5), failing=True), nowhere) is nowhere


def test_a_search_whose_steps_are_short_because_they_are_damped_has_not_converged():
    """Derivatives that are wrong leave no step that lowers the loss, and the minimum is far."""

    class Wrong(Linear):
        def linearized(self, z):
            return self.residuals(z), -self.A

    found = minimize(Wrong(10.0 * np.eye(2), np.array([30.0, -20.0])), np.zeros(2), FREE)
    assert not found.converged and np.array_equal(found.z, np.zeros(2))
