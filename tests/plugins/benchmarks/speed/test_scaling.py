"""The scaling benchmark: its numbers on small sizes, and what it says without Exudyn. Nothing here is about seconds."""

import json

import numpy as np
import pytest
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.testing import branched_links, link_chain
from calmotion_plugins.benchmarks.speed import exudyn_arm, scaling
from calmotion_plugins.benchmarks.speed.exudyn_arm import Run, time_at
from calmotion_plugins.benchmarks.speed.scaling import STEP, Growth, motion, prepared


def test_the_exponent_is_the_slope_of_logarithms():
    values = (4, 8, 32)
    assert Growth("a", values, tuple(2e-6 * v**1.3 for v in values)).exponent == pytest.approx(1.3)


def test_the_chain_is_a_chain_that_moves():
    model = prepared(*link_chain(5, 4))
    assert list(model.system.parent) == [-1, 0, 1, 2, 3, 4] and list(model.system.elastic) == [4] * 5 + [0]
    angles, rates = motion(model, 20)
    ws = Workspace.for_system(model.system)
    trajectory = simulate(model.system, rigid_state(model, angles[0]), angles, rates, STEP, ws)
    assert trajectory.max_joint_gap < 1e-8 and np.abs(trajectory.states.u).max() > 1e-9


def test_the_tree_has_fourteen_bodies_of_ten_modes():
    model = prepared(*branched_links())
    assert list(model.system.elastic) == [10] * 14 and np.bincount(model.system.parent + 1).max() == 4


def test_run_times_are_compared_at_equal_error():
    runs = [Run("a", n, 1.0 / n**2, 1e-3 * n) for n in (10, 20, 40)] + [
        Run("b", n, 4.0 / n**2, 1e-4 * n) for n in (10, 40)
    ]
    assert time_at(runs, "a", 1e-4) == pytest.approx(0.1) and time_at(runs, "b", 1e-4) == pytest.approx(0.02)


def test_each_other_code_is_compared_with_ours():
    runs = [
        Run(code, n, slow / n**2, slow * n) for code, slow in (("mujoco", 4.0), ("ours, bdf2", 1.0)) for n in (9, 99)
    ]
    report = scaling._report([Growth("bodies", (4, 8), (1e-4, 2e-4))], 1e-4, runs)
    # at equal error four times as slow a step, and twice as many of them
    assert [row["ratio"] for row in report["times_faster_than_mujoco"]] == pytest.approx([8.0, 8.0])
    assert report["times_faster_than_exudyn"] == [] and {row["code"] for row in report["exudyn"]} == {"ours, bdf2"}


def test_the_simulated_arm_converges_at_second_order():
    code = exudyn_arm.Ours("bdf2")
    exact, _ = code.run(3840)
    errors = [np.abs(code.run(steps)[0] - exact).max() for steps in (240, 480)]
    assert 1.7 < np.log2(errors[0] / errors[1]) < 2.3


def test_without_the_others_the_command_says_so_and_goes_on(capsys, monkeypatch):
    monkeypatch.setattr(scaling, "find_spec", lambda name: None)
    monkeypatch.setattr(scaling, "growths", lambda *sizes: [Growth("bodies", (4, 8), (1e-4, 2e-4))])
    assert scaling.main([]) == 0
    out = capsys.readouterr().out
    assert "install the extra `bench`" in out and "exponent 1.00" in out
    assert scaling.main(["--json", "--quick"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["tree_step_s"] > 0.0 and report["exudyn"] == [] and report["growth"][0]["name"] == "bodies"
