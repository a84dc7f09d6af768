"""The matrix of all responses against single tangent sweeps, and what it is worth."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.retargeting.problem import response_gram as module
from calmotion.retargeting.problem.response_gram import (
    LEAST_PRODUCTS,
    MANY_UNKNOWNS,
    dense_responses,
    products_worth,
    response_bands,
    response_gram,
)
from calmotion.retargeting.solver.preconditioner import BandedPreconditioner
from calmotion.retargeting.solver.truncated_cg import conjugate_gradients
from posed import looped, make_problem


@pytest.fixture(params=["rest", "pre-roll"])
def problem(request, arm, bodies, animation):
    made = make_problem(arm, bodies, animation, 0.25 if request.param == "pre-roll" else 0.0)
    return made.at(0.02 * np.random.default_rng(0).normal(size=made.size)).linearized()


def test_its_columns_are_the_products_of_the_residuals_part(problem):
    gram = response_gram(problem.sweeps.robots, problem.space)
    for d in np.random.default_rng(1).normal(size=(3, problem.space.size)):
        expected = problem.product(d) - problem.space.penalty_gradient(d)
        assert np.abs(gram @ d - expected).max() < 1e-7 * np.abs(expected).max()


def test_dense_responses_are_the_products_of_single_directions(problem):
    instants = np.arange(3, len(problem.residuals), 7, dtype=np.int32)
    dense, _ = dense_responses(problem.sweeps.robots[0], problem.space, instants)
    d = np.random.default_rng(2).normal(size=problem.space.size)
    expected, _ = problem.jvp(d)
    found = (dense @ d).reshape(len(instants), -1)
    assert np.abs(found - expected[instants]).max() < 1e-5 * np.abs(expected).max()


def test_curves_that_are_held_at_the_beginning_change_nothing_before(arm, bodies, animation):
    problem = make_problem(arm, bodies, animation)
    x = 0.02 * np.random.default_rng(0).normal(size=problem.space.size)
    first = problem.space.basis.count // 3
    held = np.arange(problem.space.size) < first * len(problem.space.motors)
    values = problem.space.basis.values.tocsc()
    problem = replace(problem, first=int(np.min(values[:, first:].indices))).at(np.where(held, 0.0, x)).linearized()
    gram = response_gram(problem.sweeps.robots, problem.space)
    d = np.where(held, 0.0, np.random.default_rng(1).normal(size=problem.space.size))
    expected = (problem.product(d) - problem.space.penalty_gradient(d))[~held]
    assert np.abs((gram @ d)[~held] - expected).max() < 1e-7 * np.abs(expected).max()


def products(problem, sharpened=None):
    """Number of products by which the system of the first iteration is solved, with no unknown fixed."""
    preconditioned = problem.precondition(np.zeros(problem.space.size, bool), sharpened)
    return len(conjugate_gradients(problem.product, problem.gradient, preconditioned, np.inf, 1e-6, 0.0, 60).p)


def test_a_sharpened_preconditioner_solves_the_system_at_once(problem):
    before = products(problem)
    assert problem.patience(None) is not None
    sharpened = problem.sharpened()
    assert products(problem, sharpened) <= 2 < before
    assert problem.patience(sharpened) is None and np.array_equal(sharpened.point, problem.x)


def test_many_unknowns_begin_with_the_matrix_unless_it_costs_more_than_it_saves(problem):
    robots, space = problem.sweeps.robots, problem.space
    many, most, too_many = (
        replace(space, motors=np.arange(n // space.basis.count + 1)) for n in (MANY_UNKNOWNS, 1400, 3000)
    )
    assert products_worth(robots, space, first=True) == products_worth(robots, space) == LEAST_PRODUCTS
    assert products_worth(robots, many, first=True) == products_worth(robots, most, first=True) == 0
    assert products_worth(robots, many) == LEAST_PRODUCTS
    assert products_worth(robots, too_many, first=True) == products_worth(robots, too_many) > LEAST_PRODUCTS


def test_no_matrix_where_responses_cannot_be_worked_out_together(arm, bodies, animation):
    character, animation = looped(arm, animation)
    cyclic = make_problem(character, bodies, animation)
    robots = cyclic.at(np.zeros(cyclic.size)).linearized().sweeps.robots
    assert products_worth(robots, cyclic.space) is None


def whole_of(bands):
    """The symmetric matrix of lower bands."""
    size = bands.shape[1]
    lower = sum(np.diag(band[: size - d], -d) for d, band in enumerate(bands))
    return lower + np.tril(lower, -1).T


def test_bands_of_responses_that_are_followed_to_the_end_are_the_whole_matrix(problem):
    gram = response_gram(problem.sweeps.robots, problem.space)
    bands = response_bands(problem.sweeps.robots, problem.space, len(problem.residuals))
    assert len(bands) == problem.space.size
    assert np.abs(whole_of(bands) - gram).max() < 1e-12 * np.abs(gram).max()


def test_cut_responses_have_few_bands_and_a_matrix_that_is_as_definite(problem, monkeypatch):
    monkeypatch.setattr(module, "_BLOCK", 2 * len(problem.space.motors))  # several blocks
    gram, lasting = response_gram(problem.sweeps.robots, problem.space), len(problem.residuals) // 8
    bands = response_bands(problem.sweeps.robots, problem.space, lasting)
    assert len(bands) < problem.space.size
    cut = whole_of(bands)
    values = np.linalg.eigvalsh(cut)
    assert values[0] > -1e-9 * values[-1]
    # responses that are cut by the end of the shot are whole in both
    values = problem.space.basis.values.tocsc()
    ends = values.indices[values.indptr[1:] - 1] + 1 + lasting
    late = np.repeat(ends >= values.shape[0], len(problem.space.motors))
    assert np.any(late) and not np.all(late)
    assert np.abs((cut - gram)[np.ix_(late, late)]).max() < 1e-9 * np.abs(gram).max()


def test_a_search_with_too_many_unknowns_for_the_whole_matrix_takes_the_bands(problem, monkeypatch):
    before = products(problem)
    monkeypatch.setattr(module, "DENSE_UNKNOWNS", problem.space.size - 1)
    monkeypatch.setattr(module, "LASTING", 0.45 * problem.rigid.grid.end)
    assert problem.patience(None) == 0
    sharpened = problem.sharpened()
    assert isinstance(sharpened.preconditioner, BandedPreconditioner) and products(problem, sharpened) < before
    monkeypatch.setattr(module, "LASTING", 0.6 * problem.rigid.grid.end)
    assert products_worth(problem.sweeps.robots, problem.space) is None
