"""One robot over one grid: tangent and adjoint of motor curves are transposes, once and in a loop."""

import numpy as np
import pytest
from calmotion.retarget.curves import sample_curves
from calmotion.retarget.prepare import Options, prepare
from calmotion.retarget.simulator import Simulator
from posed import looped


@pytest.mark.parametrize("cyclic", [False, True])
def test_derivatives_by_motors_are_transposes(arm, animation, bodies, cyclic):
    character, animation = looped(arm, animation) if cyclic else (arm, animation)
    prepared = prepare(character, animation, bodies, Options(step=1 / 240))
    grid, curves = prepared.grid, sample_curves(animation.tracks, prepared.grid)
    simulator = Simulator(prepared.model, grid.h, prepared.world, cyclic)
    run = simulator.run(curves.angles, curves.rates)
    simulator.linearize(run)
    rng = np.random.default_rng(0)
    gradient = rng.normal(size=run.trajectory.states.V.shape)
    effort = rng.normal(size=curves.angles.shape)
    values, rates = rng.normal(size=(2, *curves.angles.shape))
    for part in (gradient, effort, values, rates):
        part[: 2 if cyclic else 0] = 0.0  # the two instants of the loop before
    motion, efforts = simulator.tangent(values, rates, True)
    by_value, by_rate = simulator.adjoint(gradient, effort)
    forward = np.sum(motion * gradient) + np.sum(efforts * effort)
    backward = np.sum(by_value * values) + np.sum(by_rate * rates)
    assert abs(forward - backward) < 1e-10 * np.linalg.norm(efforts) * np.linalg.norm(effort)
    growth = simulator.run(curves.angles, curves.rates).growth
    assert (growth > 0.0) == cyclic and growth < 1.0


def test_another_robot_s_loops_begin_near_those_of_this_one(arm, animation, bodies):
    from calmotion.dynamics.model import with_damping

    character, animation = looped(arm, animation)
    prepared = prepare(character, animation, bodies, Options(step=1 / 240))
    curves = sample_curves(animation.tracks, prepared.grid)
    simulator = Simulator(prepared.model, prepared.grid.h, prepared.world, True)
    one = simulator.run(curves.angles, curves.rates)
    other = simulator.of(with_damping(prepared.model, 0.05, 4.0)).run(curves.angles, curves.rates)
    again = simulator.run(curves.angles, curves.rates)
    assert np.abs(one.target_positions - again.target_positions).max() < 1e-10
    assert 1e-4 < np.abs(one.target_positions - other.target_positions).max()
