"""The arm as a chain in MuJoCo: it is the arm, and it converges."""

import numpy as np
import pytest
from calmotion_plugins.benchmarks.speed import exudyn_arm, mujoco_arm

pytest.importorskip("mujoco")


def test_the_hub_follows_the_motion():
    """Integrated twice, the acceleration of the torque is the motion of the other codes."""
    times = np.linspace(0.0, 0.6, 60_001)
    rate = np.cumsum(mujoco_arm.accelerations(times)) * (times[1] - times[0])
    angle = np.cumsum(rate) * (times[1] - times[0])
    expected = [exudyn_arm.quarter_turn(t) for t in times[::10_000]]
    np.testing.assert_allclose(angle[::10_000], expected, atol=1e-4)


def test_it_bends_and_swings_as_the_reduced_arm_does():
    chain, ours = mujoco_arm.MujocoChain(), exudyn_arm.Ours("generalized-alpha")
    (found, _), (expected, _) = chain.run(15_360), ours.run(1_920)
    rigid = mujoco_arm.Arm.LENGTH * np.array(
        [[np.cos(a), np.sin(a)] for a in map(exudyn_arm.quarter_turn, np.arange(1, 25) / 24)]
    )
    bent = expected[:, [0, 2]] - rigid
    # segments of 4 cm leave a twentieth of the bending
    assert np.abs(found[:, :2] - rigid - bent).max() < 0.1 * np.abs(bent).max() and np.abs(bent).max() > 0.01


def test_it_converges_at_first_order():
    chain = mujoco_arm.MujocoChain()
    exact, _ = chain.run(61_440)
    errors = [np.abs(chain.run(steps)[0] - exact).max() for steps in (3_840, 7_680)]
    assert 1.5 < errors[0] / errors[1] < 2.7
