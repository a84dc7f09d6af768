"""A shot that is simulated again takes the step and the subspaces of the last run where they still do."""

import dataclasses

import numpy as np
import pytest
from calmotion.errors import IntegrationError
from calmotion.model import Track
from calmotion.model.run import RunSettings
from calmotion.simulation.bodies import with_elasticity
from calmotion.tolerance import simulate_again
from calmotion.tolerance.reduced_bodies import RunMemory
from calmotion.tolerance.simulation import simulate_to_tolerance
from calmotion.tolerance.step_error import distance, frames_of_result
from made_shots import reduced_shot

TOLERANCE = 1e-3
OPTIONS = RunSettings(tolerance=TOLERANCE)


def quiet(fraction, message):
    pass


@pytest.fixture(scope="module")
def shot(arm, animation, meshes):
    return reduced_shot(with_elasticity(arm, "stvk"), animation, meshes, OPTIONS)


@pytest.fixture(scope="module")
def first(shot):
    memory = RunMemory()
    return memory, simulate_to_tolerance(shot, OPTIONS, quiet, memory=memory)


def edited(shot, factor):
    """The shot with the motion of its first motor enlarged about its first pose."""
    track, *others = shot.animation.tracks
    track = Track(track.times, track.values[0] + factor * (track.values - track.values[0]))
    animation = dataclasses.replace(shot.animation, tracks=(track, *others), current=(track, *others))
    return dataclasses.replace(shot, animation=animation)


def positions(result, shot):
    return frames_of_result(result, shot.animation.frame_times).positions


def test_an_edit_keeps_step_and_subspaces_and_the_tolerance(shot, first, monkeypatch):
    memory, before = first
    assert memory.step > 0.0 and memory.projected is not None and memory.integrator
    moved = edited(shot, 1.02)
    anew = simulate_to_tolerance(moved, OPTIONS, quiet)
    monkeypatch.setattr("calmotion.tolerance.simulation.project_to_tolerance", None)  # not needed
    again = simulate_to_tolerance(moved, OPTIONS, quiet, memory=memory)
    assert again.step_s == pytest.approx(before.step_s) and again.dof == before.dof
    assert distance(positions(again, moved), positions(anew, moved)) < again.accuracy.estimated_m + TOLERANCE / 4
    assert distance(positions(again, moved), positions(before, shot)) > 0.0
    assert again.accuracy.step_m == pytest.approx(anew.accuracy.step_m, rel=0.5)
    assert np.all(np.isfinite(again.accuracy.efforts))


def test_a_motion_that_leaves_them_is_simulated_anew(shot, first):
    memory, _ = first
    wild = edited(shot, 4.0)
    allowed = lambda item: 0.1 * TOLERANCE  # noqa: E731
    assert simulate_again.with_last_choices(wild, OPTIONS, quiet, memory, allowed) is None
    kept = dataclasses.replace(memory)
    again = simulate_to_tolerance(wild, OPTIONS, quiet, memory=kept)
    anew = simulate_to_tolerance(wild, OPTIONS, quiet)
    np.testing.assert_array_equal(positions(again, wild), positions(anew, wild))
    assert kept.projected is not memory.projected, "the next run takes the new ones"


def test_without_a_last_run_or_where_that_fails_there_is_nothing_to_take(shot, first, monkeypatch):
    assert simulate_again.with_last_choices(shot, OPTIONS, quiet, RunMemory(), lambda item: 1.0) is None

    def fails(*arguments):
        raise IntegrationError("its joints come apart")

    monkeypatch.setattr(simulate_again, "simulate_shot", fails)
    assert simulate_again.with_last_choices(shot, OPTIONS, quiet, first[0], lambda item: 1.0) is None
