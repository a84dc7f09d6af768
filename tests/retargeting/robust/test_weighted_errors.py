"""Errors at targets in metres as they weigh."""

import dataclasses

import numpy as np
import pytest
from calmotion.retargeting.robust import weighted_errors as module
from calmotion.retargeting.robust.weighted_errors import WeightedErrors
from posed import make_problem


@pytest.fixture
def problem(arm, animation, bodies):
    """The first target weighs a quarter, and its rotation counts."""
    weights = [(0.25, 0.04), *((1.0, 0.0) for _ in arm.targets[1:])]
    targets = tuple(
        dataclasses.replace(t, position_weight=p, rotation_weight=r)
        for t, (p, r) in zip(arm.targets, weights, strict=True)
    )
    made = make_problem(dataclasses.replace(arm, targets=targets), bodies, animation)
    made.value(np.zeros(made.size))
    return made


def test_errors_are_metres_of_the_group_that_weighs_most(problem):
    found = WeightedErrors.of_objective(problem.objective, problem.grid, 1, problem.size)
    errors = found.of(problem.robots[0].residuals)
    off = problem.run.target_positions - problem.objective.intended.target_positions
    largest = max(t for t in problem.model.targets.position_weight)
    for group, place in enumerate(found.places):
        if place % 2 == 0:
            scale = np.sqrt(problem.model.targets.position_weight[place // 2] / largest)
            expected = scale * off[found.at, place // 2]
            inner = slice(1, -1)  # the rule of the integral weighs the ends by half
            assert np.allclose(errors[inner, group], expected[inner], atol=1e-12)
    assert list(found.of_position) == [place % 2 == 0 for place in found.places]
    assert 1 in found.places and found.dense_enough


def test_few_instants_where_many_would_not_fit(problem, monkeypatch):
    every = WeightedErrors.of_objective(problem.objective, problem.grid, 1, problem.size)
    rows = 3.0 * len(every.at) * len(every.places) * problem.size
    monkeypatch.setattr(module, "_ENTRIES", rows / 2.0)
    half = WeightedErrors.of_objective(problem.objective, problem.grid, 1, problem.size)
    assert np.array_equal(half.at, every.at[::2]) and half.dense_enough
    monkeypatch.setattr(module, "_ENTRIES", rows / 100.0)
    assert not WeightedErrors.of_objective(problem.objective, problem.grid, 1, problem.size).dense_enough
