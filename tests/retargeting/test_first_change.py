"""The beginning of a shot in which all curves are locked is not linearised, and nothing else changes by that."""

import dataclasses

import numpy as np
from calmotion.model import Animation, FreeTrack, Track
from calmotion.model.run import RunSettings
from calmotion.retargeting.left_out import first_change
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem.offset_basis import basis_on
from calmotion.retargeting.search import RetargetSearch
from calmotion.simulation.compiled_shot import compile_shot
from posed import ignore_progress, jerking, make_problem

OPTIONS = RunSettings(step=1 / 240, tolerance=2e-4)


def held(seconds):
    """A pose that is held, and jerks."""
    jerks = jerking()
    times = np.arange(len(jerks.frame_times) + round(120 * seconds)) / 120.0
    tracks = tuple(Track(times, np.interp(times - seconds, track.times, track.values)) for track in jerks.tracks)
    return Animation(times, tracks, tracks)


def test_a_locked_beginning_is_left_out_and_the_result_is_the_same(arm, bodies, monkeypatch):
    locks = tuple(FreeTrack(np.array([0.0, 0.52]), np.array([False, True]), k) for k in range(2))
    animation, firsts, held_back = dataclasses.replace(held(0.8), free=locks), [], RetargetSearch._held
    with monkeypatch.context() as patch:
        patch.setattr(RetargetSearch, "_held", lambda self, first: (firsts.append(first), held_back(self, first)))
        result = optimize_shot(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress)
    assert max(firsts) > 0.5 * 240
    with monkeypatch.context() as patch:
        patch.setattr(RetargetSearch, "_held", lambda self, first: None)
        plain = optimize_shot(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress)
    for one, other in zip(result.curves, plain.curves, strict=True):
        assert np.array_equal(one.frame_values, other.frame_values)
    assert result.objective_after == plain.objective_after


def test_finer_knots_before_the_first_change_have_no_effect(arm, bodies):
    problem = make_problem(arm, bodies, held(1.5), pre_roll=0.2)
    grid, basis = problem.grid, basis_on(problem.grid, np.arange(0, 201, 12), False)

    def fixed_on(until):
        return lambda some: np.repeat(some.support[:, 0] < until, 2)

    assert first_change(grid, basis, lambda some: np.zeros(2 * some.count, bool)) == 0
    for until in (0.1, 0.5, 0.6, 0.75):
        first = first_change(grid, basis, fixed_on(until))
        for breaks in (basis.breaks, np.arange(0, 201, 6)):
            some = basis_on(grid, breaks, False)
            free = ~fixed_on(until)(some)[::2]
            assert not np.any(some.values[:first][:, free].toarray()) and np.any(free)
        assert grid.times[first] > until - 2 * grid.h
    assert first_change(grid, basis, fixed_on(9.0)) == len(grid.times) - 2
