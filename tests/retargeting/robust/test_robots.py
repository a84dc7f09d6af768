"""The robots for which curves are optimised, and their places in a problem."""

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.model.uncertainty import Scenario
from calmotion.retargeting.robust.measure import errors_on
from calmotion.retargeting.robust.robots import farthest, opposite_pairs, robots_of
from calmotion.retargeting.robust.scenarios import uncertain_parameters
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.preparation import prepare
from posed import make_problem

OPTIONS = RunSettings(step=1 / 120)


@pytest.fixture(scope="module")
def shot(arm, animation, bodies):
    return compile_shot(arm, animation, bodies)


def test_robots_have_the_weights_and_the_parameters_of_their_scenarios(arm, animation, bodies):
    options = RunSettings(step=1 / 240, pre_roll=0.0)
    prepared, problem = prepare(compile_shot(arm, animation, bodies), options), make_problem(arm, bodies, animation)
    material = next(body.flexible.material for body in arm.bodies if body.simulated_flexible)
    scenarios = [Scenario({}, 0.6), Scenario({f"modulus {material.path}": 0.9}, 0.4)]
    nominal, softer = robots_of(prepared, problem, scenarios, options)
    assert nominal.simulator is problem.robots[0].simulator and (nominal.weight, softer.weight) == (0.6, 0.4)
    curves = problem.curves.angles, problem.curves.rates
    shake = [np.linalg.norm(r.perform(*curves).residuals) / np.sqrt(r.weight) for r in (nominal, softer)]
    assert 1.01 * shake[0] < shake[1] < 1.5 * shake[0]


@pytest.mark.parametrize(("count", "robots"), [(1, 1), (2, 1), (5, 5)])
def test_a_mean_is_one_of_opposite_robots(shot, count, robots):
    found = opposite_pairs(uncertain_parameters(shot), count)
    assert len(found) == robots and not found[0].factors
    assert [s.weight for s in found] == pytest.approx([1.0 / robots] * robots)
    if robots > 1:
        assert np.allclose(np.sum([np.log(list(s.factors.values())) for s in found[1:]], axis=0), 0.0)


def test_robots_with_larger_errors_are_farthest_first_and_not_alike(shot):
    tracks, parameters = shot.animation.tracks, uncertain_parameters(shot)
    found = farthest(shot, OPTIONS, tracks, parameters, 4)
    errors = errors_on(shot, OPTIONS, {"": tracks}, found, weighted=True)[""].max(axis=(1, 2))
    assert len(found) == 4 and np.all(np.diff(errors) <= 0.0)
    above = farthest(shot, OPTIONS, tracks, parameters, 4, 1.001 * errors[2])
    assert [robot.factors for robot in above] == [robot.factors for robot in found[:2]]
    assert farthest(shot, OPTIONS, tracks, parameters, 2, 2.0 * errors[0]) == ()
    assert errors_on(shot, OPTIONS, {"": tracks}, ())[""].shape == (0, len(shot.character.targets), 2)
