"""Bodies held to what a shot moves: far fewer coordinates, and the same motion."""

import dataclasses

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import Track
from calmotion.model.curves import retimed
from calmotion.model.run import RunSettings
from calmotion.model.tempo import TimeMap
from calmotion.model.tolerance import SUBSPACE
from calmotion.simulation.bodies import with_elasticity
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance import pod_subspace
from calmotion.tolerance.integrator_choice import FAST
from calmotion.tolerance.pod_subspace import ProjectedShot, project_to_subspace, reference_run
from calmotion.tolerance.step_error import distance, simulate_at
from made_shots import reduced_shot

STEP, ALLOWED = 1 / 240, 2e-5


@pytest.fixture(scope="module")
def nonlinear(arm, animation, meshes):
    return reduced_shot(with_elasticity(arm, "stvk"), animation, meshes, RunSettings(tolerance=1e-4))


@pytest.fixture(scope="module")
def known(nonlinear):
    return reference_run(nonlinear, RunSettings(), STEP)


def count(bodies):
    return [len(body.stiffness) for body in bodies]


def held(shot, known, allowed=ALLOWED):
    return ProjectedShot(shot, RunSettings(), lambda item: allowed, [known])


def off(one, other, tracks, step):
    runs = (simulate_at(shot.with_tracks(tracks), RunSettings(integrator=FAST), step) for shot in (one, other))
    return distance(*(run.positions for run in runs))


def test_few_directions_do_for_the_shot_at_any_step(nonlinear, animation, known):
    found = held(nonlinear, known)
    assert sum(count(found.shot.bodies)) < 0.6 * sum(count(nonlinear.bodies))
    assert 0.0 < found.error_m <= ALLOWED
    assert off(nonlinear, found.shot, animation.current, STEP) == found.error_m
    assert off(nonlinear, found.shot, animation.current, STEP / 4) < 1.5 * ALLOWED


def test_a_tighter_error_keeps_more_and_one_that_cannot_be_kept_all(nonlinear, known):
    kept = [held(nonlinear, known, allowed) for allowed in (1e-3, 1e-5, 0.0)]
    counts = [sum(count(item.shot.bodies)) for item in kept]
    assert counts[0] < counts[1] < counts[2] == sum(count(nonlinear.bodies))
    assert kept[2].shot is nonlinear and kept[2].error_m == 0.0
    assert kept[2].is_accurate_for(kept[2].complete_run(known.animation.current, STEP))


def test_simplifications_are_reported(nonlinear, known):
    found = held(nonlinear, known)
    rows = [body.left_out[-1] for body in found.shot.bodies[:2]]
    bodies = zip(rows, found.shot.bodies, nonlinear.bodies, nonlinear.character.bodies, strict=False)
    for row, few, all_of_them, body in bodies:
        few_of_all = f"{len(few.stiffness)} of {len(all_of_them.stiffness)}"
        assert row.what == f"{body.path}: POD subspace of {few_of_all} elastic coordinates"
    assert sum(row.estimated_error_m for row in rows) == pytest.approx(found.error_m)


def test_bodies_tell_the_error_of_the_motion_that_was_judged_last(nonlinear, animation, known):
    """Half of a motion deflects bodies by half, and leaves the directions of the whole by less."""
    found = held(nonlinear, known)
    before = found.error_m
    half = tuple(Track(track.times, 0.5 * track.values) for track in animation.current)
    assert found.is_accurate_for(found.complete_run(half, STEP)) and 0.0 < found.error_m < 0.8 * before
    assert found.error_m == off(nonlinear, found.shot, half, STEP)
    for few, all_of_them in zip(found.shot.bodies, nonlinear.bodies, strict=True):
        rows = [row for row in few.left_out if row.source == SUBSPACE]
        assert len(rows) == (len(few.stiffness) < len(all_of_them.stiffness))
    told = [row.estimated_error_m for body in found.shot.bodies for row in body.left_out if row.source == SUBSPACE]
    assert sum(told) == pytest.approx(found.error_m)


def test_a_pod_subspace_is_extended_by_curves_that_deflect_bodies_differently(nonlinear, animation):
    still = Track(animation.frame_times, np.zeros(len(animation.frame_times)))
    swing, lift = ((animation.tracks[0], still), (still, animation.tracks[1]))
    found = held(nonlinear, reference_run(nonlinear.with_tracks(swing), RunSettings(), STEP))
    assert found.is_accurate_for(found.complete_run(swing, STEP))
    first = found.shot
    assert off(nonlinear, first, lift, STEP) > ALLOWED and not found.is_accurate_for(found.complete_run(lift, STEP))
    assert sum(count(found.shot.bodies)) > sum(count(first.bodies))
    for tracks in (swing, lift):
        assert off(nonlinear, found.shot, tracks, STEP) <= ALLOWED
    assert found.is_accurate_for(found.complete_run(lift, STEP)) and 0.0 < found.error_m <= ALLOWED


def test_subspaces_are_projected_anew_for_another_tempo_of_another_length(nonlinear, animation, known):
    """What is known at the first tempo has other instants, and is no motion to compare with."""
    end = float(animation.frame_times[-1])
    times, frames = np.linspace(0.0, end, 8), len(animation.frame_times)
    slower = retimed(
        animation, TimeMap(times, times * (frames + 1) / (frames - 1)), np.arange(frames + 2) * end / (frames - 1)
    )
    tight = 1e-9
    found = held(nonlinear, known).of_shot(dataclasses.replace(nonlinear, animation=slower), lambda item: tight)
    assert not found.is_accurate_for(found.complete_run(slower.current, STEP))
    assert found.error_m <= tight


def trials(monkeypatch, fails=lambda shot, divides: False):
    """Coordinates and division of steps of each simulation that is tried; those that are to fail do."""
    tried, plain = [], pod_subspace.simulate_at

    def simulated(shot, options, step, elastic=False, divides=True):
        tried.append((count(shot.bodies), divides))
        if fails(shot, divides):
            raise ShotError("a step cannot be solved")
        return plain(shot, options, step, elastic, divides)

    monkeypatch.setattr(pod_subspace, "simulate_at", simulated)
    return tried


def test_subspaces_that_do_not_do_for_one_motion_are_not_tried_for_more(nonlinear, animation, known, monkeypatch):
    found = held(nonlinear, known)
    fewest = count(found.shot.bodies)
    faster = reference_run(
        nonlinear.with_tracks([Track(track.times, 2.0 * track.values) for track in animation.current]),
        RunSettings(), STEP,
    )  # fmt: skip
    tried = trials(monkeypatch)
    assert not found.is_accurate_for(faster)
    assert all(sum(coordinates) >= sum(fewest) for coordinates, _ in tried)
    sizes = [coordinates for coordinates, _ in tried[1:]]
    assert sizes[-2:] == [count(found.shot.bodies)] * 2, "the last one does for both motions"
    assert all(sizes.count(size) <= 2 for size in sizes), "and no size is tried again"


def test_steps_of_bodies_in_few_directions_are_not_divided_unless_none_does_without(nonlinear, known, monkeypatch):
    fewest = count(held(nonlinear, known).shot.bodies)
    tried = trials(monkeypatch)
    assert count(held(nonlinear, known).shot.bodies) == fewest
    assert tried and not any(divides for _, divides in tried)
    monkeypatch.undo()
    tried = trials(monkeypatch, lambda shot, divides: not divides)
    assert count(held(nonlinear, known).shot.bodies) == fewest
    assert tried[0][0] == next(coordinates for coordinates, divides in tried if divides), "all of them once more"
    monkeypatch.undo()
    tried = trials(monkeypatch)
    assert held(nonlinear, known, 0.0).shot is nonlinear
    assert not any(divides for _, divides in tried), "those that were simulated are not tried again"


def test_linear_bodies_and_those_of_the_users_choice_keep_theirs(arm, nonlinear, bodies, animation, known):
    linear = compile_shot(arm, animation, bodies)
    assert project_to_subspace(linear, RunSettings(), STEP, lambda item: 1.0).shot is linear
    character, reduced = nonlinear.character, nonlinear.bodies
    for own in ({"mode_count": 6}, {"max_frequency": 500.0}, {"modes_share": 1e-3}):
        settings = dataclasses.replace(character.bodies[0].flexible, **own)
        body = dataclasses.replace(character.bodies[0], flexible=settings)
        chosen = dataclasses.replace(character, bodies=(body, *character.bodies[1:]))
        kept = count(held(nonlinear.with_character(chosen), known).shot.bodies)
        assert kept[0] == len(reduced[0].stiffness) and kept[1] < len(reduced[1].stiffness)


def test_a_motion_that_is_known_is_not_simulated_again(nonlinear, animation, known, monkeypatch):
    monkeypatch.setattr(pod_subspace, "reference_run", lambda *arguments: pytest.fail("simulated again"))
    project_to_subspace(
        nonlinear.with_tracks(list(animation.current)), RunSettings(), STEP, lambda item: ALLOWED, known
    )


def test_either_can_be_forced(nonlinear, known):
    kept = ProjectedShot(nonlinear, RunSettings(directions="on"), lambda item: 1.0, [known])
    assert kept.shot is nonlinear
    fewest = ProjectedShot(nonlinear, RunSettings(directions="off"), lambda item: 0.0, [known])
    loosely = held(nonlinear, known, 1.0).shot.bodies
    assert count(fewest.shot.bodies) == count(loosely) != count(nonlinear.bodies)
    assert fewest.error_m > 0.0 and fewest.is_accurate_for(fewest.complete_run(known.animation.current, STEP))


def test_more_directions_tell_whether_a_motion_leaves_the_subspaces(nonlinear, animation, known):
    found = held(nonlinear, known)
    run = simulate_at(found.shot, RunSettings(integrator=FAST), STEP)
    near = found.finer_run(STEP, RunSettings(integrator=FAST))
    assert distance(run.positions, near.positions) == pytest.approx(found.error_m, rel=0.3)
    assert held(nonlinear, known, 0.0).finer_run(STEP, RunSettings()) is None, "nothing is finer than all coordinates"
    faster = [Track(track.times, 3.0 * track.values) for track in animation.current]
    moved = found.of_shot(nonlinear.with_tracks(faster), lambda item: ALLOWED)
    assert moved.shot.bodies is not nonlinear.bodies and count(moved.shot.bodies) == count(found.shot.bodies)
    off_by_finer = distance(
        simulate_at(moved.shot, RunSettings(integrator=FAST), STEP).positions,
        moved.finer_run(STEP, RunSettings(integrator=FAST)).positions,
    )
    assert off_by_finer > 0.3 * off(nonlinear, found.shot, faster, STEP)
