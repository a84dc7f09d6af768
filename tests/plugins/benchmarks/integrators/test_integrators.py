"""The comparison of integrators: orders, and the stiff scene of the seed."""

import json

import numpy as np
import pytest
from calmotion.multibody import SimulationFailure
from calmotion.testing import quintic, shot_of
from calmotion_plugins.benchmarks.integrators import integrators
from calmotion_plugins.benchmarks.integrators.integrators import (
    LATER,
    RATE,
    WORKING_STEP,
    Fate,
    Scene,
    arm_scene,
    order_of,
    orders,
    stiff_scene,
)
from four_bar import four_bar

SECOND = {"bdf2": (16, 32), "newmark": (16, 32), "generalized-alpha": (16, 32)}


def four_bar_scene():
    """A four-bar with a flexible coupler, whose crank makes a turn in a second."""
    return Scene(four_bar(modes=7, damping=0.1), shot_of(quintic(2.0 * np.pi, 1.0, LATER), LATER + 1.0, rate=RATE))


@pytest.mark.parametrize(
    "scene, explicit",
    [
        pytest.param(arm_scene, (16, 32), id="flexible arm", marks=pytest.mark.long),
        pytest.param(four_bar_scene, (32, 64), id="four-bar", marks=pytest.mark.long),
    ],
)
def test_orders_are_those_of_the_methods(scene, explicit):
    rows = orders(scene(), {**SECOND, "rk4": explicit}, finest=16)
    for integrator in SECOND:
        assert order_of(rows, integrator) == pytest.approx(2.0, abs=0.1), rows
        assert order_of(rows, integrator, "velocity_error") > 1.7, rows
    assert order_of(rows, "rk4") > 3.5, rows
    finest = {row.integrator: row.position_error for row in rows}
    assert finest["rk4"] < 0.01 * finest["newmark"] < 0.01 * finest["bdf2"]


def test_only_bdf2_takes_thin_steel_links_through_a_fast_motion():
    """Seed, section 3: RK4 at once with steps thousands of times smaller, Newmark later, BDF2 not at all."""
    scene = stiff_scene()
    run = scene.run(WORKING_STEP, "bdf2")
    assert run.trajectory.refined == () and run.trajectory.max_joint_gap < 1e-6
    with pytest.raises(SimulationFailure) as newmark:
        scene.run(WORKING_STEP, "newmark")
    assert 0.1 < newmark.value.time_s < 2.0
    with pytest.raises(SimulationFailure) as explicit:
        scene.run(WORKING_STEP / 4000, "rk4", 0.1)
    assert explicit.value.time_s < WORKING_STEP


def test_the_command_prints_one_object(capsys, monkeypatch):
    monkeypatch.setattr(integrators, "orders", lambda scene: orders(scene, {"bdf2": (4, 8)}, finest=1))
    monkeypatch.setattr(integrators, "fates", integrators_fates)
    assert integrators.main(["--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert set(report) == {"orders", "stiff"} and len(report["orders"]) == 2


def integrators_fates(scene):
    return [Fate("bdf2", WORKING_STEP, "runs to the end", 0.1, 0.0)]
