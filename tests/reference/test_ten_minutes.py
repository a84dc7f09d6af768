"""What drifts does not, over ten minutes of motion: unit quaternions and joints that stay together."""

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from mechanisms import mechanism

H = 1.0 / 480.0


def moved(model, seconds):
    """Every motor in a wave of its own, the first one ever on."""
    t = H * np.arange(round(seconds / H) + 1)
    angles, rates = np.zeros((len(t), len(model.motor))), np.zeros((len(t), len(model.motor)))
    for joint, motor in enumerate(model.motor):
        if motor < 0:
            continue
        w = 2.0 + 0.7 * motor
        angles[:, joint] = 0.4 * (1.0 - np.cos(w * t)) + (motor == 0) * 3.0 * (t - np.sin(t))
        rates[:, joint] = 0.4 * w * np.sin(w * t) + (motor == 0) * 3.0 * (1.0 - np.cos(t))
    start = rigid_state(model, np.where(model.motor < 0, model.rest_angles, angles[0]))
    return simulate(model.system, start, angles, rates, H, Workspace.for_system(model.system))


def arm():
    return compiled(chain(4, driven=(0, 1, 3), length=0.3))


def crank_rocker():
    points = [(0.0, 0.0), (0.0, 0.12), (0.4, 0.4), (0.5, 0.0)]
    bars = [(0, 1), (1, 2), (3, 2)]
    return mechanism(points, bars, [(-1, 0, 0), (0, 1, 1), (1, 2, 2), (-1, 2, 3)], driven=[0])


@pytest.mark.parametrize(
    "seconds", [30.0, pytest.param(600.0, marks=pytest.mark.long)], ids=["half a minute", "ten minutes"]
)
@pytest.mark.parametrize("build", [arm, crank_rocker])
def test_quaternions_keep_their_norm_and_joints_their_place(build, seconds):
    trajectory = moved(build(), seconds)
    assert np.abs(np.linalg.norm(trajectory.states.q, axis=2) - 1.0).max() < 1e-9
    assert trajectory.max_joint_gap < 1e-8
    assert trajectory.refined == () and np.all(np.isfinite(trajectory.states.lam))
