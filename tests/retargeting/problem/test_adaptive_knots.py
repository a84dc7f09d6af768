"""Knots where the motion needs them: finer where that pays, none where the spline has no use for one."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import WeightTrack
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem import adaptive_knots
from calmotion.retargeting.problem.adaptive_knots import (
    breaks_for,
    converted,
    fitted,
    halved,
    refined_breaks,
    useful_knots,
)
from calmotion.retargeting.problem.offset_basis import basis_on, make_basis, uniform_breaks
from calmotion.retargeting.solver.gauss_newton import Ends, Search, minimize
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.time_grid import make_grid
from posed import FINE_FRAMES, ignore_progress, jerking, make_problem

OPTIONS = RunSettings(step=1 / 240)


@pytest.fixture(scope="module")
def grid():
    return make_grid(FINE_FRAMES, 1 / 240, 0.0)


def test_intervals_are_halved_where_frames_and_the_least_distance_allow_it(grid):
    breaks = np.array([0, 3, 8, 20, 24, 60, 180], np.int32)
    # frame 1 may carry no knot, and 1/60 s is two frames
    assert halved(grid, breaks).tolist() == [0, 3, 5, 8, 14, 20, 22, 24, 42, 60, 120, 180]
    chosen = np.array([True, False, True, False, False, False])
    assert halved(grid, breaks, chosen).tolist() == [0, 3, 8, 14, 20, 24, 60, 180]
    slow = make_grid(np.arange(49) / 24.0, 1 / 240, 0.0)
    every = uniform_breaks(slow, 0.05)
    assert np.array_equal(halved(slow, every), every), "every frame carries one"


@pytest.mark.parametrize("cyclic", [False, True])
@pytest.mark.parametrize("kept", [False, True])
def test_finer_knots_contain_the_same_offsets(cyclic, kept):
    grid = make_grid(FINE_FRAMES, 1 / 240, 0.0, cyclic)
    old = make_basis(grid, 0.1, kept)
    new = basis_on(grid, halved(grid, old.breaks, np.arange(len(old.breaks) - 1) % 3 == 0), kept)
    x = np.random.default_rng(0).normal(size=2 * old.count)
    y = converted(old, new, x, 2)
    assert new.count > old.count
    assert np.abs(new.values @ y.reshape(-1, 2) - old.values @ x.reshape(-1, 2)).max() < 1e-11
    assert np.abs(new.accelerations @ y.reshape(-1, 2) - old.accelerations @ x.reshape(-1, 2)).max() < 1e-6
    for motor in range(2):
        assert np.array_equal(useful_knots(new, y.reshape(-1, 2)[:, motor]), old.knots)


def test_an_offset_on_coarse_knots_gets_the_knots_that_it_needs(grid):
    fine = basis_on(grid, np.union1d(uniform_breaks(grid, 0.05), np.arange(60, 80, 3)).astype(np.int32), False)
    offsets = fine.values @ np.random.default_rng(1).normal(size=(fine.count, 2))
    breaks = breaks_for(grid, False, offsets)
    basis = basis_on(grid, breaks, False)
    inside = (breaks > 60) & (breaks < 80)
    assert set(uniform_breaks(grid, 0.05)) <= set(breaks) and inside.sum() >= 5
    assert np.abs(basis.values @ fitted(basis, offsets) - offsets)[grid.times < 0.4].max() < 1e-3
    plain = make_basis(grid, 0.05, False)
    offsets = plain.values @ np.random.default_rng(2).normal(size=(plain.count, 1))
    assert np.array_equal(breaks_for(grid, False, offsets), plain.breaks)


def test_intervals_without_an_offset_have_no_knots(grid):
    basis = make_basis(grid, 0.05, False)
    coefficients = np.random.default_rng(3).normal(size=basis.count)
    coefficients[8:20] = 0.0
    knots = useful_knots(basis, coefficients)
    rests = (basis.values @ coefficients == 0.0) & (grid.times > 0.1) & (grid.times < 1.4)
    first, last = grid.times[rests][[0, -1]]
    assert last - first > 0.3 and not np.any((knots > first + 1e-9) & (knots < last - 1e-9))
    assert set(knots) <= set(basis.knots) and len(knots) < len(basis.knots)


def test_knots_are_wanted_where_something_is_to_be_gained(arm, bodies):
    """Nothing is judged after 0.6 s."""
    weights = tuple(
        WeightTrack(target, False, np.array([0.6, 0.65]), np.array([1.0, 0.0])) for target in range(len(arm.targets))
    )
    turned = WeightTrack(1, True, np.array([0.6, 0.65]), np.array([0.05, 0.0]))
    animation = dataclasses.replace(jerking(0.3), weights=(*weights, turned))
    problem = make_problem(arm, bodies, animation)

    def free(basis):
        return np.zeros(basis.count * 2, bool)

    at = minimize(problem, Search.start(np.zeros(problem.size)), free(problem.space.basis), Ends(1e-6)).at
    linear = at.linearized()
    breaks = refined_breaks(at, linear, free, 1e-6)
    new = np.setdiff1d(breaks, problem.space.basis.breaks) / 120.0
    assert len(new) >= 4 and len(breaks) < len(halved(problem.grid, problem.space.basis.breaks))
    assert new.max() < 0.75
    assert refined_breaks(at, linear, free, 1.0) is None, "nothing gains a metre"


def test_knots_that_follow_the_motion_reach_what_uniform_ones_do_not(arm, bodies, monkeypatch):
    monkeypatch.setattr(adaptive_knots, "FIRST", 0.1)
    found = optimize_shot(compile_shot(arm, jerking(), bodies), OPTIONS, ignore_progress)
    uniform = optimize_shot(
        compile_shot(arm, jerking(), bodies), dataclasses.replace(OPTIONS, knot_spacing=0.1), ignore_progress
    )
    every = optimize_shot(
        compile_shot(arm, jerking(), bodies), dataclasses.replace(OPTIONS, knot_spacing=1 / 60), ignore_progress
    )
    gained = uniform.objective_after - every.objective_after
    assert gained > 0.0 and uniform.objective_after - found.objective_after > 0.8 * gained
    assert uniform.search.parameters < found.search.parameters < 0.8 * every.search.parameters
    values = [step.objective for step in found.search.steps]
    dropped = 1.01  # at the end, what offsets that gain next to nothing may cost
    assert all(b <= a * dropped for a, b in zip(values, values[1:], strict=False))
