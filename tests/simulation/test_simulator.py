"""One robot over one grid: tangent and adjoint of motor curves are transposes, once and in a loop."""

import dataclasses

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.model.motor import Rotor
from calmotion.model.run import RunSettings
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.model.model import with_damping
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulator import Simulator
from linkage_arm import linkage_arm, performance
from posed import looped, make_problem


@pytest.mark.parametrize("cyclic", [False, True])
def test_derivatives_by_motors_are_transposes(arm, animation, bodies, cyclic):
    character, animation = looped(arm, animation) if cyclic else (arm, animation)
    prepared = prepare(compile_shot(character, animation, bodies), RunSettings(step=1 / 240))
    grid, curves = prepared.grid, sample_curves(animation.tracks, prepared.grid)
    simulator = Simulator(prepared.model, grid.h, prepared.world, cyclic)
    run = simulator.run(curves.angles, curves.rates)
    linear = simulator.linearize(run)
    rng = np.random.default_rng(0)
    gradient = rng.normal(size=run.trajectory.states.V.shape)
    effort = rng.normal(size=curves.angles.shape)
    values, rates = rng.normal(size=(2, *curves.angles.shape))
    for part in (gradient, effort, values, rates):
        part[: 2 if cyclic else 0] = 0.0  # the two instants of the loop before
    motion, efforts = linear.tangent(values, rates, True)
    by_value, by_rate = linear.adjoint(gradient, effort)
    forward = np.sum(motion * gradient) + np.sum(efforts * effort)
    backward = np.sum(by_value * values) + np.sum(by_rate * rates)
    assert abs(forward - backward) < 1e-10 * np.linalg.norm(efforts) * np.linalg.norm(effort)
    floquet_multiplier = simulator.run(curves.angles, curves.rates).floquet_multiplier
    assert (floquet_multiplier > 0.0) == cyclic and floquet_multiplier < 1.0


def test_derivatives_of_servos_with_delayed_commands_match_differences():
    rotor, h = Rotor(0.05, 2e3, 2.0, 0.1, 0.2), 1 / 200
    character = chain(2, driven=(0, 1), length=0.3)
    gains = {"model": "servo", "position_gain": 150.0, "velocity_gain": 4.0, "rotor": rotor, "max_torque": 14.0}
    motors = [dataclasses.replace(m, **gains, delay=d) for m, d in zip(character.motors, (0.0, 0.0123), strict=True)]
    simulator = Simulator(compiled(dataclasses.replace(character, motors=tuple(motors))), h, None, False)
    times = h * np.arange(60)[:, None]
    w = np.array([[9.0, 14.0]])
    values, rates = 0.3 * np.sin(w * times) ** 2, 0.3 * w * np.sin(2 * w * times)
    by = np.cos(w * times), -w * np.sin(w * times)
    motion, _ = simulator.linearize(simulator.run(values, rates)).tangent(*by, False)

    def moved(e):
        return simulator.run(values + e * by[0], rates + e * by[1]).trajectory.states.u

    found, e = motion[..., 6:], 1e-4
    expected = (8.0 * (moved(e) - moved(-e)) - (moved(2 * e) - moved(-2 * e))) / (12 * e)
    assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()


def test_the_cycles_of_a_changed_robot_start_near_those_of_this_one(arm, animation, bodies):
    character, animation = looped(arm, animation)
    prepared = prepare(compile_shot(character, animation, bodies), RunSettings(step=1 / 240))
    curves = sample_curves(animation.tracks, prepared.grid)
    simulator = Simulator(prepared.model, prepared.grid.h, prepared.world, True)
    one = simulator.run(curves.angles, curves.rates)
    other = simulator.of(with_damping(prepared.model, 0.05, 4.0)).run(curves.angles, curves.rates)
    again = simulator.run(curves.angles, curves.rates)
    assert np.abs(one.target_positions - again.target_positions).max() < 1e-10
    assert 1e-4 < np.abs(one.target_positions - other.target_positions).max()


def with_a_held_beginning(make, until):
    """Two equal problems, which of their coefficients act before a time, and random values of the others."""
    problem, other = make(), make()
    fixed = np.repeat(problem.space.basis.support[:, 0] < until, len(problem.space.motors))
    x = np.where(fixed, 0.0, 0.01 * np.random.default_rng(0).normal(size=problem.size))
    return problem, other, fixed, x


@pytest.mark.parametrize("kind", ["arm", "pre-roll", "linkage"])
def test_a_kept_beginning_does_not_change_the_result(arm, bodies, animation, kind):
    if kind == "linkage":
        character, meshes = linkage_arm(modes=4)
        parts = character, reduce_bodies(character, span_tree(character), meshes), performance(0.8)
    else:
        parts = arm, bodies, animation
    motors = tuple(dataclasses.replace(m, max_velocity=1.0, max_torque=2.0) for m in parts[0].motors)
    parts = dataclasses.replace(parts[0], motors=motors), *parts[1:]
    problem, other, fixed, x = with_a_held_beginning(
        lambda: make_problem(*parts, 0.25 if kind == "pre-roll" else 0.0, limited=True), 0.35
    )
    # the first simulation is known, and the one of another point near by
    first = int(np.searchsorted(problem.grid.times, 0.4 - 1e-9))
    problem = dataclasses.replace(problem, first=first)
    near = problem.at(0.5 * x, problem.at(np.zeros(problem.size)))
    at, anew = problem.at(x, near), other.at(x)
    assert at.merit == anew.merit
    found, expected = at.run.trajectory, anew.run.trajectory
    for part in ("c", "q", "u", "turn", "V", "lam"):
        assert np.array_equal(getattr(found.states, part), getattr(expected.states, part)), part
    assert found.newton_iterations == expected.newton_iterations and found.max_joint_gap == expected.max_joint_gap
    assert np.array_equal(found.margins, expected.margins)
    assert np.array_equal(at.run.target_rotations, anew.run.target_rotations)
    assert np.array_equal(at.limited["effort"], anew.limited["effort"])
    linear, whole = at.linearized(), anew.linearized()
    one, two = linear.gradient, whole.gradient
    assert np.abs(one - two)[~fixed].max() < 1e-12 * np.abs(two).max()
    if not problem.grid.pre_steps:
        motors = len(problem.space.motors)
        assert not np.any(one[:motors] == two[:motors]), "what is held is not worked out"
    d = np.where(fixed, 0.0, np.random.default_rng(1).normal(size=len(x)))
    one, two = linear.product(d), whole.product(d)
    assert np.abs(one - two)[~fixed].max() < 1e-12 * np.abs(two).max()


def test_a_known_motion_is_simulated_again_only_on_request(arm, bodies, animation):
    prepared = prepare(compile_shot(arm, animation, bodies), RunSettings(step=1 / 240))
    grid, curves = prepared.grid, sample_curves(animation.tracks, prepared.grid)
    simulator = Simulator(prepared.model, grid.h, prepared.world, False)
    given = curves.angles, curves.rates
    assert simulator.run(*given) is not simulator.run(*given), "measurements of time are those of simulations"
    run = simulator.run(*given)
    assert simulator.run(*given, run) is run
    jump = curves.angles.copy()
    jump[60:] = np.nan
    with pytest.raises(SimulationFailure):
        simulator.run(jump, curves.rates, run)
    # where less stays as it is, it is linearised anew
    gradient = np.random.default_rng(0).normal(size=run.trajectory.states.V.shape)
    late, _ = simulator.linearize(run, 10).adjoint(gradient, None)
    whole, _ = simulator.linearize(run).adjoint(gradient, None)
    assert np.array_equal(late[10:], whole[10:]) and not np.any(late[:10]) and np.all(whole[:10])
