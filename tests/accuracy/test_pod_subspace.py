"""Bodies held to what a shot moves: far fewer coordinates, and the same motion."""

import dataclasses

import numpy as np
import pytest
from calmotion.accuracy.integrator_choice import FAST
from calmotion.accuracy.pod_subspace import ProjectedBodies, project_to_subspace, reference_run
from calmotion.accuracy.step_error import distance, simulate_at
from calmotion.multibody.model.topology import span_tree
from calmotion.shot import Track
from calmotion.simulation.bodies import reduce_bodies, with_elasticity
from calmotion.simulation.prepare import Options, load_envelopes

STEP, ALLOWED = 1 / 240, 2e-5


@pytest.fixture(scope="module")
def nonlinear(arm, animation, meshes):
    character = with_elasticity(arm, "stvk")
    loads = load_envelopes(character, animation, meshes, Options())
    return character, reduce_bodies(character, span_tree(character), meshes, None, loads, 1e-4)


@pytest.fixture(scope="module")
def known(nonlinear, animation):
    return reference_run(nonlinear[0], animation, nonlinear[1], Options(), STEP)


def count(bodies):
    return [len(body.stiffness) for body in bodies]


def held(character, bodies, known, allowed=ALLOWED):
    return ProjectedBodies(character, bodies, Options(), lambda item: allowed, [known])


def off(character, animation, one, other, step):
    return distance(
        *(simulate_at(character, animation, b, Options(integrator=FAST), step).positions for b in (one, other))
    )


def test_few_directions_do_for_the_shot_at_any_step(nonlinear, animation, known):
    character, bodies = nonlinear
    found = held(character, bodies, known)
    assert sum(count(found.bodies)) < 0.6 * sum(count(bodies))
    assert 0.0 < found.error_m <= ALLOWED
    assert off(character, animation, bodies, found.bodies, STEP) == found.error_m
    assert off(character, animation, bodies, found.bodies, STEP / 4) < 1.5 * ALLOWED


def test_a_tighter_error_keeps_more_and_one_that_cannot_be_kept_all(nonlinear, known):
    kept = [held(*nonlinear, known, allowed) for allowed in (1e-3, 1e-5, 0.0)]
    counts = [sum(count(item.bodies)) for item in kept]
    assert counts[0] < counts[1] < counts[2] == sum(count(nonlinear[1]))
    assert kept[2].bodies is nonlinear[1] and kept[2].error_m == 0.0
    assert kept[2].hold_for(known.animation, STEP)


def test_simplifications_are_reported(nonlinear, known):
    character, bodies = nonlinear
    found = held(character, bodies, known)
    rows = [body.left_out[-1] for body in found.bodies[:2]]
    for row, few, all_of_them, body in zip(rows, found.bodies, bodies, character.bodies, strict=False):
        few_of_all = f"{len(few.stiffness)} of {len(all_of_them.stiffness)}"
        assert row.what == f"{body.path}: POD subspace of {few_of_all} elastic coordinates"
    assert sum(row.estimated_error_m for row in rows) == pytest.approx(found.error_m)


def test_a_pod_subspace_is_extended_by_curves_that_deflect_bodies_differently(nonlinear, animation):
    character, bodies = nonlinear
    still = Track(animation.frame_times, np.zeros(len(animation.frame_times)))
    swing, lift = ((animation.tracks[0], still), (still, animation.tracks[1]))
    swung, lifted = (dataclasses.replace(animation, current=tracks) for tracks in (swing, lift))
    found = held(character, bodies, reference_run(character, swung, bodies, Options(), STEP))
    assert found.hold_for(swung, STEP)
    first = found.bodies
    assert off(character, lifted, bodies, first, STEP) > ALLOWED and not found.hold_for(lifted, STEP)
    assert sum(count(found.bodies)) > sum(count(first))
    for shot in (swung, lifted):
        assert off(character, shot, bodies, found.bodies, STEP) <= ALLOWED
    assert found.hold_for(lifted, STEP) and 0.0 < found.error_m <= ALLOWED


def test_linear_bodies_and_those_of_the_users_choice_keep_theirs(arm, nonlinear, bodies, animation, known):
    assert project_to_subspace(arm, animation, bodies, Options(), STEP, lambda item: 1.0).bodies is bodies
    assert project_to_subspace(arm, animation, None, Options(), STEP, lambda item: 1.0).bodies is None
    character, reduced = nonlinear
    for own in ({"mode_count": 6}, {"max_frequency": 500.0}, {"modes_share": 1e-3}):
        settings = dataclasses.replace(character.bodies[0].flexible, **own)
        body = dataclasses.replace(character.bodies[0], flexible=settings)
        chosen = dataclasses.replace(character, bodies=(body, *character.bodies[1:]))
        kept = count(held(chosen, reduced, known).bodies)
        assert kept[0] == len(reduced[0].stiffness) and kept[1] < len(reduced[1].stiffness)


def test_a_motion_that_is_known_is_not_simulated_again(nonlinear, animation, known, monkeypatch):
    from calmotion.accuracy import pod_subspace as motion_subspace

    character, bodies = nonlinear
    monkeypatch.setattr(motion_subspace, "reference_run", lambda *arguments: pytest.fail("simulated again"))
    again = dataclasses.replace(animation, current=tuple(animation.current))
    project_to_subspace(character, again, bodies, Options(), STEP, lambda item: ALLOWED, known)


def test_either_can_be_forced(nonlinear, known):
    character, bodies = nonlinear
    kept = ProjectedBodies(character, bodies, Options(directions="on"), lambda item: 1.0, [known])
    assert kept.bodies is bodies
    fewest = ProjectedBodies(character, bodies, Options(directions="off"), lambda item: 0.0, [known])
    assert count(fewest.bodies) == count(held(character, bodies, known, 1.0).bodies) != count(bodies)
    assert fewest.error_m > 0.0 and fewest.hold_for(known.animation, STEP)
