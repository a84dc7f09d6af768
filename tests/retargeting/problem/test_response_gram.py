"""The matrix of all responses against single tangent sweeps, and what it is worth."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.retargeting.problem.response_gram import LARGE, LEAST, products_worth, response_gram
from calmotion.retargeting.solver.truncated_cg import conjugate_gradients
from posed import looped, make_problem


@pytest.fixture(params=["rest", "pre-roll"])
def problem(request, arm, bodies, animation):
    made = make_problem(arm, bodies, animation, 0.25 if request.param == "pre-roll" else 0.0)
    made.value(0.02 * np.random.default_rng(0).normal(size=made.size))
    made.linearize()
    return made


def test_its_columns_are_the_products_of_the_residuals_part(problem):
    gram = response_gram(problem.robots, problem.space)
    for d in np.random.default_rng(1).normal(size=(3, problem.size)):
        expected = problem.product(d) - problem.penalty_gradient(d)
        assert np.abs(gram @ d - expected).max() < 1e-7 * np.abs(expected).max()


def test_curves_that_are_held_at_the_beginning_change_nothing_before(arm, bodies, animation):
    problem = make_problem(arm, bodies, animation)
    x = 0.02 * np.random.default_rng(0).normal(size=problem.size)
    first = problem.space.basis.count // 3
    held = np.arange(problem.size) < first * len(problem.space.motors)
    problem.value(np.where(held, 0.0, x))
    values = problem.space.basis.values.tocsc()
    problem.hold(int(np.min(values[:, first:].indices)))
    problem.value(np.where(held, 0.0, x))
    problem.linearize()
    gram = response_gram(problem.robots, problem.space)
    d = np.where(held, 0.0, np.random.default_rng(1).normal(size=problem.size))
    expected = (problem.product(d) - problem.penalty_gradient(d))[~held]
    assert np.abs((gram @ d)[~held] - expected).max() < 1e-7 * np.abs(expected).max()


def test_a_sharpened_preconditioner_solves_the_system_at_once(problem):
    free = np.zeros(problem.size, bool)
    gradient = problem.gradient()

    def products():
        path = conjugate_gradients(problem.product, gradient, problem.precondition(free), np.inf, 1e-6, 0.0, 60)
        return len(path.p)

    before = products()
    assert problem.patience is not None and len(problem.sharpened_at) == 0
    problem.sharpen()
    assert products() <= 2 < before
    assert problem.patience is None and np.array_equal(problem.sharpened_at, problem.x)


def test_many_unknowns_begin_with_the_matrix_unless_it_costs_more_than_it_saves(problem):
    robots, space = problem.robots, problem.space
    many, most, too_many = (replace(space, motors=np.arange(n // space.basis.count + 1)) for n in (LARGE, 1400, 3000))
    assert products_worth(robots, space, first=True) == products_worth(robots, space) == LEAST
    assert products_worth(robots, many, first=True) == products_worth(robots, most, first=True) == 0
    assert products_worth(robots, many) == LEAST
    assert products_worth(robots, too_many, first=True) == products_worth(robots, too_many) > LEAST


def test_no_matrix_where_responses_cannot_be_worked_out_together(arm, bodies, animation):
    cyclic = make_problem(*((looped(arm, animation)[0], bodies, looped(arm, animation)[1])))
    cyclic.value(np.zeros(cyclic.size))
    cyclic.linearize()
    assert products_worth(cyclic.robots, cyclic.space) is None
