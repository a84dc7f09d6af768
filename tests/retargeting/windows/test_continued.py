"""Simulations that go on from known states: as if they had begun at rest, with exact derivatives."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.motor import DRIVE
from calmotion.model.run import RunSettings
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.retargeting.windows.continued import Beginning, ContinuedSimulator, needed_instants
from calmotion.retargeting.windows.parts import part_of
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.forward import run_forward
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.preparation import prepare
from long_moves import long_moves

FIRST, LAST = 20, 45  # frames


def posed(character, bodies):
    """A shot, its curves, its simulation from rest, and a part of it."""
    prepared = prepare(compile_shot(character, long_moves(2.0), bodies), RunSettings(step=1 / 120))
    curves = sample_curves(prepared.shot.animation.tracks, prepared.grid)
    workspace = Workspace.for_system(prepared.model.system)
    run = run_forward(prepared.model, workspace, curves.angles, curves.rates, prepared.grid.h, prepared.world)
    known = needed_instants(prepared.model, prepared.grid.h)
    return prepared, curves, run, part_of(prepared, FIRST, LAST, known)


@pytest.fixture(scope="module", params=["prescribed", "delayed drives"])
def case(request, arm, bodies):
    if request.param == "prescribed":
        return posed(arm, bodies)
    motors = [
        dataclasses.replace(motor, model=DRIVE, position_gain=400.0, velocity_gain=8.0, delay=0.021)
        for motor in arm.motors
    ]
    return posed(dataclasses.replace(arm, motors=tuple(motors)), bodies)


def continued(case):
    prepared, curves, run, part = case
    row = int(prepared.grid.frames[FIRST])
    beginning = Beginning.at(run, row, part.known)
    return ContinuedSimulator(prepared.model, prepared.grid.h, part.prepared.world, beginning), part.curves_of(curves)


def test_a_part_moves_as_it_does_in_the_whole_shot(case):
    prepared, _, run, part = case
    simulator, curves = continued(case)
    again = simulator.run(curves.angles, curves.rates)
    for one, two in zip(again.trajectory.states, run.trajectory.states, strict=True):
        np.testing.assert_allclose(one, two[part.rows], atol=1e-9)
    np.testing.assert_allclose(again.target_positions, run.target_positions[part.rows], atol=1e-11)
    assert part.prepared.grid.times[part.known - 1] == pytest.approx(0.0, abs=1e-12)
    assert len(part.prepared.grid.times) == part.rows.stop - part.rows.start
    assert (
        part.prepared.grid.frames[-1] == len(again.target_positions) - 1 == prepared.grid.frames[LAST] - part.rows.start
    )


def test_a_second_run_goes_on_from_the_first_instant_that_differs(case):
    simulator, curves = continued(case)
    one = simulator.run(curves.angles, curves.rates)
    assert simulator.run(curves.angles, curves.rates, one) is one
    changed = curves.angles.copy()
    changed[60:] += 0.01 * np.linspace(0.0, 1.0, len(changed) - 60)[:, None] ** 3
    two = simulator.run(changed, curves.rates, one)
    fresh, _ = continued(case)
    three = fresh.run(changed, curves.rates)
    np.testing.assert_array_equal(two.target_positions, three.target_positions)


def test_derivatives_are_those_of_the_part_and_transposed(case):
    part = case[3]
    simulator, curves = continued(case)
    run = simulator.run(curves.angles, curves.rates)
    linear = simulator.linearize(run)
    random = np.random.default_rng(3)
    h, rows = part.prepared.grid.h, np.arange(len(curves.angles))
    bump = np.where(rows > part.known + 5, (rows - part.known - 5) * h, 0.0)[:, None]
    size = random.normal(size=(1, curves.angles.shape[1]))
    values, rates = bump**3 * size, 3.0 * bump**2 * size
    motion, _ = linear.tangent(values, rates, False)
    gradient = random.normal(size=motion.shape)
    by_value, by_rate = linear.adjoint(gradient, None)
    assert np.sum(motion * gradient) == pytest.approx(np.sum(values * by_value) + np.sum(rates * by_rate), rel=1e-10)
    eps = 1e-6
    ends = [simulator.run(curves.angles + s * eps * values, curves.rates + s * eps * rates) for s in (1, -1)]
    slope = (ends[0].trajectory.states.u - ends[1].trajectory.states.u) / (2.0 * eps)
    scale = np.abs(slope).max()
    np.testing.assert_allclose(motion[:, :, 6 : 6 + slope.shape[2]], slope, atol=1e-5 * scale)
