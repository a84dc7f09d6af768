"""The linear model of a pose against the tangent of the nonlinear simulation."""

import numpy as np
import pytest
from calmotion.multibody import WORLD, Mechanism, linearize, pose_model, simulate
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

STEP, INSTANTS = 5e-4, 801


def _arm(**motor):
    """Two links; the shoulder gives as `motor` says, the elbow follows its input exactly."""
    arm = Mechanism(gravity=(0.0, 0.0, -9.81))
    upper = arm.body("upper", 1.2, center=(0.25, 0, 0), inertia=(0.001, 0.03, 0.03))
    fore = arm.body("fore", 0.8, center=(0.2, 0, 0), inertia=(0.001, 0.012, 0.012), position=(0.5, 0, 0))
    shoulder = arm.joint("revolute", WORLD, upper, position=(0, 0, 0), axis=(0, -1, 0))
    elbow = arm.joint("revolute", upper, fore, position=(0.5, 0, 0), axis=(0, -1, 0))
    arm.motor(shoulder, position_gain=900.0, velocity_gain=3.0, **motor)
    arm.motor(elbow)
    arm.target(fore, position=(0.9, 0, 0))
    return arm.compile()


def _pendulum_on_slider(**motor):
    """A trolley with a free pendulum: the equilibrium follows the trolley, the swing is a mode without a spring."""
    arm = Mechanism(gravity=(0.0, 0.0, -9.81))
    trolley = arm.body("trolley", 1.0, center=(0, 0, 0), inertia=(0.01, 0.01, 0.01))
    bob = arm.body("bob", 0.5, center=(0, 0, -0.3), inertia=(0.002, 0.002, 0.001))
    rail = arm.joint("prismatic", WORLD, trolley, position=(0, 0, 0), axis=(1, 0, 0))
    arm.joint("revolute", trolley, bob, position=(0, 0, 0), axis=(0, 1, 0))
    arm.motor(rail, **motor)
    arm.target(bob, position=(0, 0, -0.4))
    return arm.compile()


CASES = {
    "drive": (_arm, {"model": "drive"}),
    "drive that damps the joint": (_arm, {"model": "drive", "damping_on": "joint"}),
    "pendulum on a slider": (_pendulum_on_slider, {"model": "prescribed"}),
    "pendulum on a slider that gives": (
        _pendulum_on_slider,
        {"model": "drive", "position_gain": 400.0, "velocity_gain": 5.0},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_small_motions_are_those_of_the_simulation(case):
    build, motor = CASES[case]
    model = build(**motor)
    count = int(model.motor.max()) + 1
    pose, direction = np.array([0.4, -0.9])[:count], np.array([1.0, -0.6])[:count]
    times = STEP * np.arange(INSTANTS)
    shape = np.interp(times, [0, 0.15, 1.0], [0, 1, 1])
    change = CubicSpline(times, (shape**3 * (10 - 15 * shape + 6 * shape**2))[:, None] * direction)
    run = simulate(model, np.tile(pose, (INSTANTS, 1)), np.zeros((INSTANTS, count)), step=STEP)
    exact = linearize(run).jvp(change(times), change(times, 1))

    linear = pose_model(model, pose)
    n = len(linear.omega)

    def rate(t, x):
        force = linear.by_acceleration @ change(t, 2) + linear.by_rate @ change(t, 1)
        return np.concatenate([x[n:], force - linear.damping @ x[n:] - linear.omega**2 * x[:n]])

    found = solve_ivp(rate, (0.0, times[-1]), np.zeros(2 * n), t_eval=times, rtol=1e-9, atol=1e-12, max_step=0.01).y
    motion = np.einsum("kim,tm->tki", linear.targets_by_input, change(times))
    motion += np.einsum("kin,nt->tki", linear.targets_by_mode, found[:n])
    vibration = np.abs(motion - np.einsum("kim,tm->tki", linear.targets_by_input, change(times))).max()
    assert vibration > 1e-3, "the case would say nothing"
    np.testing.assert_allclose(motion, exact, atol=5e-3 * vibration)
