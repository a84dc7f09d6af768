import numpy as np
import pytest
from calmotion.retarget.gauss_newton import conjugate_gradients, minimize


class Problem:
    """A nonlinear least-squares problem with a known Jacobian: r = A x + 0.1 (B x)^2 - b."""

    def __init__(self, seed=0, rows=12, columns=5):
        rng = np.random.default_rng(seed)
        self.A, self.B, self.b = (
            rng.normal(size=(rows, columns)),
            rng.normal(size=(rows, columns)),
            rng.normal(size=rows),
        )
        self.values = []

    def residual(self, x):
        return self.A @ x + 0.1 * (self.B @ x) ** 2 - self.b

    def value(self, x):
        self.x = x.copy()
        value = 0.5 * float(np.sum(self.residual(x) ** 2))
        self.values.append(value)
        return value

    def linearize(self):
        self.J = self.A + 0.2 * (self.B @ self.x)[:, None] * self.B
        return self.J.T @ self.residual(self.x)

    def product(self, direction):
        return self.J.T @ (self.J @ direction)

    def precondition(self, fixed):
        return lambda r: r / np.sum(self.J**2, axis=0)

    def gain_is_small(self, gain, value):
        return gain < 1e-14 * value


def test_conjugate_gradients_solve_a_positive_definite_system():
    rng = np.random.default_rng(2)
    M = rng.normal(size=(8, 8))
    M = M @ M.T + np.eye(8)
    b = rng.normal(size=8)
    x, Mx, used = conjugate_gradients(lambda v: M @ v, b, lambda r: r / np.diag(M), 1e-12, 50)
    assert np.abs(M @ x - b).max() < 1e-9 and np.abs(Mx - M @ x).max() < 1e-9 and used <= 12


@pytest.mark.parametrize("seed", range(5))
def test_minimum_is_stationary_and_every_iterate_is_lower(seed):
    problem = Problem(seed)
    solution = minimize(problem, np.zeros(5), np.array([[-np.inf, np.inf]] * 5), max_iterations=60)
    problem.value(solution.x)
    assert np.abs(problem.linearize()).max() < 1e-5
    values = [iterate.value for iterate in solution.history]
    assert all(b < a for a, b in zip(values, values[1:], strict=False))


@pytest.mark.parametrize("seed", range(5))
def test_bounds_hold_and_the_result_meets_the_optimality_conditions(seed):
    problem = Problem(seed)
    bounds = np.array([[-0.05, 0.08]] * 5)
    solution = minimize(problem, np.zeros(5), bounds, max_iterations=80)
    x = solution.x
    assert np.all(x >= bounds[:, 0]) and np.all(x <= bounds[:, 1])
    problem.value(x)
    gradient = problem.linearize()
    low, high = x <= bounds[:, 0], x >= bounds[:, 1]
    assert np.any(low | high), "the case should have active bounds"
    assert np.all(gradient[low] >= -1e-6) and np.all(gradient[high] <= 1e-6)
    assert np.abs(gradient[~low & ~high]).max(initial=0.0) < 1e-4


def test_a_failing_evaluation_is_survived():
    problem = Problem(0)
    inner = problem.value

    def value(x):
        return np.inf if np.linalg.norm(x) > 0.2 else inner(x)

    problem.value = value
    solution = minimize(problem, np.zeros(5), np.array([[-np.inf, np.inf]] * 5))
    assert np.linalg.norm(solution.x) <= 0.2 and solution.history[-1].value < 0.5 * np.sum(problem.b**2)
