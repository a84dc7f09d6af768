"""An arm with a closed loop that shakes by a quarter of a metre, calmed: through damped problems to the real one."""

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem.offset_basis import make_basis
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.posing import CLOSENESS, SMOOTHNESS
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.solver.damping_homotopy import LARGE_ANGLE, damping_homotopy
from calmotion.retargeting.solver.gauss_newton import Ends, Search, minimize
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.intended_motion import rigid_motion
from calmotion.simulation.preparation import modes_of, prepare
from calmotion.simulation.target_errors import Objective
from made_shots import soft_linkage_shot
from posed import ignore_progress

OPTIONS = RunSettings(step=1 / 120)


@pytest.fixture(scope="module")
def shot():
    return soft_linkage_shot()


def make_problem(shot, prepared, spacing):
    """The problem without limits, knots `spacing` [s] apart."""
    model, grid, world = prepared.model, prepared.grid, prepared.world
    curves = sample_curves(shot.animation.tracks, grid)
    meant = rigid_motion(model, curves.angles, curves.rates, grid.h, world, grid.cyclic)
    objective = Objective.over(model, meant, grid, shot.animation.weights)
    count = len(shot.character.motors)
    motors = np.arange(count, dtype=np.int32)
    space = OffsetSpace.uncoupled(make_basis(grid, spacing, False), motors, count, SMOOTHNESS, CLOSENESS)
    return RetargetProblem.of_model(model, grid, curves, objective, space, world)


def largest(simulation):
    return simulation.position_errors[simulation.motion.times >= -1e-9].max(axis=0)


@pytest.fixture(scope="module")
def result(shot):
    return optimize_shot(shot, OPTIONS, ignore_progress)


@pytest.mark.long
def test_the_hand_that_was_off_by_a_quarter_of_a_metre_follows_to_a_few_millimetres(result):
    before, after = largest(result.before), largest(result.after)
    assert before[1] > 0.2
    assert after[1] < 0.01 and after[1] < before[1] / 35.0
    assert max(result.before.max_joint_gap, result.after.max_joint_gap) < 1e-6
    assert result.search.stopped == "converged"


@pytest.mark.long
def test_the_way_through_damped_problems_is_shorter(shot):
    prepared = prepare(shot, OPTIONS)
    problem = make_problem(shot, prepared, 0.05)
    zero, free = np.zeros(problem.size), np.zeros(problem.size, bool)
    begin = problem.at(zero)
    assert begin.error > LARGE_ANGLE * problem.lever()
    start = damping_homotopy(begin, free, float(modes_of(prepared)[0][0]))
    near = start.at.merit
    # as much work as the approach took, spent on the problem itself; a product is a fifth of a simulation
    direct = minimize(problem, Search.start(zero), free, Ends(1e-6, 8))
    spent = start.evaluations + 0.2 * start.products
    reached = [i.value for i in direct.history if i.evaluations + 0.2 * i.products <= spent]
    assert len(reached) < len(direct.history) and near < 0.5 * min(reached)


def test_a_problem_with_more_damping_differs_in_nothing_else(shot):
    prepared = prepare(shot, OPTIONS)
    problem = make_problem(shot, prepared, 0.2)
    x = np.zeros(problem.size)
    value = problem.at(x).merit
    more = problem.damped(0.2, 10.0 / np.pi)
    assert more.at(x).merit < 0.7 * value, "it shakes less"
    # a rounding that ends Newton's method one correction earlier has changed this value by 7e-10
    assert problem.damped(0.0, 3.0).at(x).merit == pytest.approx(value, rel=1e-8)
    assert problem.at(x).merit == pytest.approx(value, rel=1e-12), "the problem itself stays as it was"
