"""The equations of motion against closed forms."""

import numpy as np
import pytest
from calmotion_plugins.diagnosis.kernels import follow, follow_with_play, march, oscillate

H = 1e-3
TIMES = H * np.arange(3000)
NONE = np.zeros(len(TIMES))


def ringing(omega, damping):
    """The answer of a loop to a step of 1."""
    damped = omega * np.sqrt(1.0 - damping**2)
    decay = np.exp(-damping * omega * TIMES)
    return 1.0 - decay * (np.cos(damped * TIMES) + damping * omega / damped * np.sin(damped * TIMES))


def followed(command, gains, inertia=0.5, load=NONE):
    out = np.zeros((3, len(TIMES)))
    follow(H, command, np.gradient(command, H), np.full(len(TIMES), inertia), load, NONE, command, np.array(gains), out)
    return out


@pytest.mark.parametrize("damping", [0.05, 0.3, 0.7])
def test_a_loop_answers_a_step_as_its_closed_form_says(damping):
    omega, inertia = 2.0 * np.pi * 5.0, 0.5
    step = np.where(TIMES > 0.0, 1.0, 0.0)
    own = followed(step, [inertia * omega**2, 2.0 * damping * omega * inertia, 0.0, 0.0, 0.0, 0.05])
    np.testing.assert_allclose(own[0][1:], ringing(omega, damping)[1:], atol=0.03)


def test_friction_holds_a_joint_within_the_band_of_friction_over_gain():
    gain, friction = 100.0, 3.0
    ramp = np.minimum(0.1 * TIMES, 0.2)
    own = followed(ramp, [gain, 8.0, 0.0, friction, 0.0, 0.05])
    assert np.all(own[0][TIMES < 0.99 * friction / gain / 0.1] == 0.0)
    sliding = (TIMES > 1.0) & (TIMES < 1.9)
    np.testing.assert_allclose((ramp - own[0])[sliding], friction / gain + 8.0 * 0.1 / gain, rtol=0.02)


@pytest.mark.parametrize(("friction", "at"), [(0.0, 0.9), (0.5, 0.9 + 0.5 / 20.0), (4.0, 1.05)])
def test_a_joint_begins_at_rest_where_it_was_as_far_as_friction_holds_it(friction, at):
    """A soft loop under a load that grows with the angle, near 1.05 rad: 10 (2 - y) = 12.5 + 10 (y - 1.05)."""
    out, ones = np.zeros((3, len(TIMES))), np.ones(len(TIMES))
    gains = np.array([10.0, 1.0, 0.0, friction, 0.0, 0.05])
    follow(H, 2.0 * ones, NONE, 0.1 * ones, 12.5 * ones, 10.0 * ones, 1.05 * ones, gains, out)
    np.testing.assert_allclose(out[0], at, atol=1e-9)


def test_a_load_lies_on_the_side_of_its_play_to_which_it_is_pressed():
    width, load = 0.02, np.where(TIMES < 1.5, 4.0, -4.0)
    own = np.zeros((4, len(TIMES)))
    gains = np.array([1000.0, 20.0, 0.0])
    follow_with_play(H, NONE, NONE, np.full(len(TIMES), 0.1), load, gains, width, own)
    np.testing.assert_allclose(own[0][[1400, -1]], [-0.5 * width - 4e-3, 0.5 * width + 4e-3], atol=1e-4)
    (
        np.testing.assert_allclose(own[3][[1400, -1]], [-4e-3, 4e-3], atol=1e-4),
        "the motor gives by the load over its gain",
    )
    free = np.zeros((4, len(TIMES)))
    follow_with_play(H, NONE, NONE, np.full(len(TIMES), 0.1), load, gains, 0.0, free)
    assert np.abs(np.ptp(own[0]) - np.ptp(free[0]) - width) < 0.3 * width


def test_a_system_between_poses_swings_at_its_frequencies():
    omega = 2.0 * np.pi * np.array([4.0, 9.0])
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    mass = np.tile(np.diag([2.0, 0.5]), (3, 1, 1))
    root = np.sqrt(mass[0])
    stiffness = np.tile(root @ turn @ np.diag(omega**2) @ turn.T @ root, (3, 1, 1))
    force = np.zeros((len(TIMES), 2))
    force[:2, 0] = 100.0
    out = np.zeros((3, len(TIMES), 2))
    march(H, np.linspace(0.0, 2.0, len(TIMES)), mass, 0.0 * mass, stiffness, force, out)
    modal = (turn.T @ root @ out[0].T).T
    for k in range(2):
        own = np.zeros((3, len(TIMES), 1))
        pushed = (turn.T @ np.linalg.inv(root) @ force.T).T[:, [k]]
        oscillate(H, np.full((len(TIMES), 1), omega[k]), 0.0, pushed, own)
        np.testing.assert_allclose(modal[:, k], own[0][:, 0], atol=0.06 * np.abs(own[0]).max())
        spectrum = np.abs(np.fft.rfft(modal[:, k] * np.hanning(len(TIMES)), 16 * len(TIMES)))
        assert np.fft.rfftfreq(16 * len(TIMES), H)[np.argmax(spectrum)] == pytest.approx(
            omega[k] / 2.0 / np.pi, rel=0.01
        )
