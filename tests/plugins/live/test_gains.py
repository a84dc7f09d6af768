"""The regulator with preview against the least squares problem that it solves."""

import numpy as np
import pytest
from calmotion.multibody import WORLD, Mechanism, pose_model
from calmotion_plugins.live import LiveSettings, gains_at
from calmotion_plugins.live.regulation.gains import riccati
from hinges import TICK, hinge, moves, rms, two_hinges, weighting, with_free_motion


def played(gains, intended, window):
    """Deviation of the targets, shape [T, rows], where so many ticks of the motion are known ahead."""
    return states(gains, intended, window) @ gains.targets.T


def states(gains, intended, window):
    """Of the regulator, shape [T, X]."""
    rates = np.gradient(intended, TICK, axis=0)
    accelerations = np.diff(intended, 2, axis=0, prepend=intended[:1], append=intended[-1:]) / TICK**2
    impulses = gains.impulses(accelerations, rates, np.zeros((len(rates), len(gains.pose.shapes))), TICK)
    x, found = np.zeros(len(gains.transition)), []
    for k in range(len(impulses)):
        known = impulses[k : k + window]
        change = -gains.feedback @ x - np.einsum("kmi,ki->m", gains.preview[: len(known)], known)
        found.append(x)
        x = gains.transition @ x + gains.by_change @ change + gains.by_impulse @ impulses[k]
    return np.array(found)


@pytest.mark.parametrize("pose", [hinge(), two_hinges()])
def test_commands_with_all_of_the_future_known_are_the_least_squares_solution(pose):
    motors, ticks = pose.by_acceleration.shape[1], 200
    gains = gains_at(pose, np.eye(motors), weighting(ticks, motors, penalty=1e-4))
    impulses = np.zeros((ticks, gains.by_impulse.shape[1]))
    impulses[20:40] = np.sin(np.arange(20))[:, None]
    # all states as linear functions of all changes, after which the robot is left to the feedback's value
    A, B, E, size = gains.transition, gains.by_change, gains.by_impulse, len(gains.transition)
    least = gains.targets.T @ gains.targets
    end = np.linalg.cholesky(riccati(A, B, least, np.full(motors, (1e-4 / TICK) ** 2)) + 1e-18 * np.eye(size)).T
    by_changes, offset, rows, right = np.zeros((size, ticks * motors)), np.zeros(size), [], []
    for k in range(ticks):
        rows.append(gains.targets @ by_changes)
        right.append(-gains.targets @ offset)
        by_changes = A @ by_changes
        by_changes[:, k * motors : (k + 1) * motors] += B
        offset = A @ offset + E @ impulses[k]
    rows += [end @ by_changes, 1e-4 / TICK * np.eye(ticks * motors)]
    right += [-end @ offset, np.zeros(ticks * motors)]
    best = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0].reshape(ticks, motors)
    x, found = np.zeros(size), []
    for k in range(ticks):
        found.append(-gains.feedback @ x - np.einsum("kmi,ki->m", gains.preview[: ticks - k], impulses[k:]))
        x = A @ x + B @ found[-1] + E @ impulses[k]
    np.testing.assert_allclose(found, best, atol=1e-5 * np.abs(best).max())


def test_a_free_motion_that_no_motor_reaches_leaves_the_commands_as_they_are():
    pose = two_hinges()
    intended, chosen = moves(4.0, 2, seed=2), weighting(40, 2)
    one, other = (gains_at(p, np.eye(2), chosen) for p in (pose, with_free_motion(pose, seen=0.1)))
    left = [played(gains, intended, 40) for gains in (one, other)]
    np.testing.assert_allclose(left[1], left[0], atol=1e-6 * np.abs(left[0]).max())


def test_gains_for_several_robots_leave_less_on_one_that_is_slower():
    intended, window = moves(20.0, 1, seed=1), round(0.17 / TICK)
    slower = gains_at(hinge(2.7), np.eye(1), weighting(window, 1))
    left = []
    for share in (0.0, 2 / 3):
        gains = gains_at(hinge(), np.eye(1), weighting(window, 1).with_others(0.1, share))
        rates = np.gradient(intended, TICK, axis=0)
        accelerations = np.diff(intended, 2, axis=0, prepend=intended[:1], append=intended[-1:]) / TICK**2
        known = gains.impulses(accelerations, rates, np.zeros((len(rates), 1)), TICK)
        own = slower.impulses(accelerations, rates, np.zeros((len(rates), 1)), TICK)
        x, robot, found = np.zeros(len(gains.transition)), np.zeros(4), []
        for k in range(len(known)):
            ahead = known[k : k + window]
            change = -gains.feedback @ x - np.einsum("kmi,ki->m", gains.preview[: len(ahead)], ahead)
            found.append(slower.targets @ robot)
            x = gains.transition @ x + gains.by_change @ change + gains.by_impulse @ known[k]
            robot = slower.transition @ robot + slower.by_change @ change + slower.by_impulse @ own[k]
        left.append(rms(np.array(found)))
    assert left[1] < 0.7 * left[0]


def test_half_the_longest_period_leaves_at_most_twice_what_the_whole_future_does():
    """Two hinges and two modes."""
    pose, intended = two_hinges(), moves(12.0, 2)
    half = round(np.pi / pose.omega[0] / TICK)
    rest, left = np.eye(2), []
    for window in (len(intended), half, half // 4):
        left.append(rms(played(gains_at(pose, rest, weighting(window, 2)), intended, window)))
    assert left[0] <= left[1] <= 2.0 * left[0] < left[2]


def test_motors_more_than_targets_need_do_not_wander_where_frequencies_are_uncertain():
    """Four hinges for one place in a plane: what no command removes on all robots must not pay for great deviations."""
    arm, last = Mechanism(), WORLD
    for k in range(4):
        link = arm.body(f"{k}", 0.8, center=(0.15, 0, 0), inertia=(0.001, 0.01, 0.01), position=(0.3 * k, 0, 0))
        joint = arm.joint("revolute", last, link, position=(0.3 * k, 0, 0), axis=(0, -1, 0))
        arm.motor(joint, model="drive", position_gain=300.0 - 60.0 * k, velocity_gain=0.2)
        last = link
    arm.target(last, position=(1.2, 0, 0))
    pose, intended = pose_model(arm.compile(), [0.5, -0.7, -0.6, 0.9]), 0.2 * moves(8.0, 4, seed=4)
    lever = float(np.linalg.norm(pose.targets_by_input[0, :3], axis=0).max())
    window, deviations, left = round(0.8 * np.pi / pose.omega[0] / TICK), [], []
    for closeness in (
        2e-3 * lever,
        LiveSettings().closeness(lever, 1e-3, weighting(1, 4).with_others(0.1, 2 / 3).spread),
    ):
        weights = weighting(window, 4, closeness=closeness).with_others(0.1, 2 / 3)
        x = states(gains_at(pose, np.eye(4), weights), intended, window)
        deviations.append(np.abs(x[:, :4]).max())
        left.append(rms(played(gains_at(pose, np.eye(4), weights), intended, window)))
    # with a penalty by which hardly anything is regulated, rounding decides how far doubling converges
    free = [rms(played(gains_at(pose, np.eye(4), weighting(1, 4, penalty=p)), intended, 1)) for p in (1e2, 1e4, 1e6)]
    unshaped = free[2]
    np.testing.assert_allclose(free, unshaped, rtol=1e-4)
    assert deviations[1] < 0.25 < deviations[0], deviations
    assert left[0] <= left[1] < 0.1 * unshaped, (left, unshaped)
