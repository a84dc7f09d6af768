"""The robots for which curves are optimised."""

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.retargeting.robust.choice import (
    REACH,
    Candidates,
    _directions,
    _shared,
    chosen_scenarios,
)
from calmotion.retargeting.robust.measure import errors_on
from calmotion.retargeting.robust.scenarios import scenario_at, uncertain_parameters
from calmotion.simulation.compiled_shot import compile_shot

OPTIONS = RunSettings(step=1 / 120)


@pytest.fixture(scope="module")
def shot(arm, animation, bodies):
    return compile_shot(arm, animation, bodies)


def chosen(shot, count, kind):
    return chosen_scenarios(shot, OPTIONS, shot.animation.tracks, uncertain_parameters(shot), count, kind)


def test_pairs_are_shared_in_proportion():
    assert _shared(3, np.array([1.0, 0.4, 0.1])) == [2, 1, 0]
    assert _shared(1, np.array([1.0, 0.4, 0.1])) == [1, 0, 0]
    assert _shared(4, np.array([1.0, 1.0])) == [2, 2]


def test_the_first_direction_moves_the_targets_most(shot):
    directions, sizes = _directions(shot, OPTIONS, shot.animation.tracks, uncertain_parameters(shot))
    assert np.allclose(directions @ directions.T, np.eye(len(directions)))
    assert np.all(np.diff(sizes) <= 0.0)
    # damping hardly moves a target, even when it is twice or half
    assert abs(directions[0, 1]) < 0.3


def test_the_nominal_robot_is_first_and_others_are_opposite_pairs(shot):
    found = chosen(shot, 5, "worst")
    assert len(found) == 5 and not found[0].factors
    assert [s.weight for s in found] == pytest.approx([0.2] * 5)
    logs = np.array([np.log(list(s.factors.values())) for s in found[1:]])
    assert np.allclose(logs.sum(axis=0), 0.0)
    # in standard deviations
    away = np.linalg.norm(logs / [p.spread for p in uncertain_parameters(shot)], axis=1)
    assert sorted(away) == pytest.approx([REACH / 2, REACH / 2, REACH, REACH])


@pytest.mark.parametrize("kind", ["worst", "mean"])
@pytest.mark.parametrize("count", [1, 2])
def test_a_robot_alone_is_the_nominal_one(shot, kind, count):
    (alone,) = chosen(shot, count, kind)
    assert not alone.factors and alone.weight == 1.0


def test_a_mean_over_the_robots_is_that_of_their_distribution(shot):
    parameters = uncertain_parameters(shot)
    found = chosen(shot, 3, "mean")
    direction = np.log(list(found[1].factors.values())) / [p.spread for p in parameters]
    direction /= np.linalg.norm(direction)
    values = [
        float(direction @ (np.log(list(s.factors.values())) / [p.spread for p in parameters])) if s.factors else 0.0
        for s in found
    ]
    weights = [s.weight for s in found]
    assert sum(weights) == pytest.approx(1.0)
    assert sum(w * v**2 for w, v in zip(weights, values, strict=True)) == pytest.approx(1.0)


def test_robots_with_larger_errors_are_added(shot):
    tracks, parameters = shot.animation.tracks, uncertain_parameters(shot)
    axis = np.eye(len(parameters))[0]
    near = tuple(scenario_at(parameters, 0.1 * k * axis) for k in (0, 1, 2))
    candidates = Candidates.of(shot, OPTIONS, parameters)

    def largest(robots):
        return errors_on(shot, OPTIONS, {"": tracks}, robots)[""].max()

    found, left = candidates.worst(tracks, largest(near[1:]))
    assert len(found) == 2
    errors = errors_on(shot, OPTIONS, {"": tracks}, (*near[1:], *found))[""].max(axis=1)
    assert errors[2:].min() > 1.05 * errors[:2].max()
    # what is tried once more are the other ones with large errors, which are the first to be taken in next
    assert 0 < len(left.points) < len(candidates.points) - 2
    following, _ = left.worst(tracks, largest(near[1:]))
    again = errors_on(shot, OPTIONS, {"": tracks}, following)[""].max(axis=1)
    assert len(following) == 2 and Candidates.NEAR * errors[2:].max() < again.max() <= errors[2:].max()
    far = [scenario_at(parameters, 6.0 * k * axis) for k in (-1, 1)]
    assert candidates.worst(tracks, largest(far))[0] == ()


def test_no_robot_is_worse_where_none_is_left_to_try(shot):
    tracks, parameters = shot.animation.tracks, uncertain_parameters(shot)
    assert errors_on(shot, OPTIONS, {"": tracks}, ())[""].shape == (0, len(shot.character.targets))
    found, left = Candidates(shot, OPTIONS, parameters, np.zeros((0, len(parameters)))).worst(tracks, 1e-3)
    assert found == () and len(left.points) == 0
