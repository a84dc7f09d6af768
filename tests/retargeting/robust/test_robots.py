"""The robots of scenarios in a problem."""

import numpy as np
from calmotion.model.robust.robots import Scenario
from calmotion.model.run import RunSettings
from calmotion.retargeting.robust.robots import robots_of
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.preparation import prepare
from posed import make_problem


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
