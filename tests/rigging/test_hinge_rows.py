"""Hinges that perform rotations: how many, about which axes, by which angles."""

import numpy as np
import pytest
from calmotion.rigging.hinge_rows import derivatives, follow, hinge_pair, hinges_for, residuals
from scipy.spatial.transform import Rotation

TIMES = np.linspace(0.0, 2.0, 60)


def turns(axes, angles):
    """Products of turns about axes."""
    found = Rotation.identity(len(angles))
    for k, axis in enumerate(axes):
        found = found * Rotation.from_rotvec(angles[:, k, None] * axis)
    return found.as_matrix()


def waves(count, size=0.9):
    """Angles that begin at zero."""
    return np.stack([size * (np.sin((1.0 + k) * TIMES + k) - np.sin(k)) for k in range(count)], axis=1)


AXES = {
    "one": np.array([[0.0, 0.6, 0.8]]),
    "two": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]),
    "three": np.eye(3),
    "three oblique": np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.6, 0.8]]),
}


@pytest.mark.parametrize("axes", AXES.values(), ids=AXES.keys())
def test_angles_of_successive_hinges_are_recovered(axes):
    times = np.linspace(0.0, 2.0, 60)
    meant = np.stack([0.9 * np.sin((1.0 + k) * times + k) for k in range(len(axes))], axis=1)
    turn = Rotation.identity(len(times))
    for k, axis in enumerate(axes):
        turn = turn * Rotation.from_rotvec(meant[:, k, None] * axis)
    found, off = follow(axes, turn.as_matrix())
    assert np.abs(found - meant).max() < 1e-9 and off.max() < 1e-9


def test_a_hinge_takes_the_rotation_about_its_axis_and_reports_the_residual():
    axis = np.array([[0.0, 0.0, 1.0]])
    swing = Rotation.from_rotvec([0.05, 0.0, 0.0])
    turn = Rotation.from_rotvec(np.linspace(0.0, 12.0, 50)[:, None] * axis) * swing
    found, off = follow(axis, turn.as_matrix())
    assert np.allclose(found[:, 0], np.linspace(0.0, 12.0, 50)) and np.allclose(off, 0.05)


@pytest.mark.parametrize("angle", [-3.1, -1.7, 1.7, 3.1])
def test_a_hinge_starts_within_180_degrees(angle):
    axis = np.array([[0.0, 0.6, 0.8]])
    assert follow(axis, Rotation.from_rotvec(angle * axis).as_matrix())[0] == pytest.approx(angle)


def test_a_joint_that_rests_needs_no_hinge():
    row = hinges_for(np.tile(np.eye(3), (5, 1, 1)), 1e-5)
    assert row.axes.shape == (0, 3) and row.angles.shape == (5, 0)


def test_a_joint_that_rotates_about_one_axis_needs_one_hinge():
    axis = np.array([[0.48, 0.6, 0.64]])
    row = hinges_for(turns(axis, waves(1)), 1e-7)
    assert np.allclose(row.axes, axis) and np.allclose(row.angles, waves(1)) and row.residual.max() < 1e-7


@pytest.mark.parametrize("oblique", [0.0, 0.3])
def test_a_universal_joint_needs_two_also_where_oblique(oblique):
    axes = np.array([[0.0, 0.0, 1.0], [0.0, np.cos(oblique), np.sin(oblique)]])
    row = hinges_for(turns(axes, waves(2) * [1.0, 0.5]), np.radians(0.5))
    assert len(row.axes) == 2 and row.residual.max() < np.radians(0.5)


def test_any_other_motion_needs_three_and_is_exact():
    row = hinges_for(turns(np.eye(3), waves(3)), 1e-7)
    assert len(row.axes) == 3 and row.residual.max() < 1e-7
    assert np.allclose(row.axes @ row.axes.T, np.eye(3), atol=1e-12)
    assert np.abs(np.diff(row.angles, axis=0)).max() < 0.3


def test_a_looser_tolerance_needs_fewer_hinges():
    D = turns(np.eye(3), waves(3) * [1.0, 0.01, 0.01])
    assert len(hinges_for(D, np.radians(2.0)).axes) == 1 and len(hinges_for(D, 1e-6).axes) == 3


def test_many_revolutions_stay_one_hinge():
    angles = np.linspace(0.0, 30.0, 300)[:, None]
    row = hinges_for(turns(np.array([[0.0, 0.0, 1.0]]), angles), 1e-6)
    assert len(row.axes) == 1 and np.allclose(np.abs(row.angles), angles)


def test_the_best_of_all_hinges_is_found_where_none_keeps_the_tolerance():
    row = hinges_for(turns(AXES["two"], waves(2)), 0.0)
    assert len(row.axes) in (2, 3) and row.residual.max() < 1e-9


def turned(pair, count=60):
    """Rotations about two axes that begin at the identity, and their principal directions."""
    first, second = 0.9 * np.sin(TIMES[:count]), 0.4 * (np.sin(2.0 * TIMES[:count] + 1.0) - np.sin(1.0))
    turn = Rotation.from_rotvec(first[:, None] * pair[0]) * Rotation.from_rotvec(second[:, None] * pair[1])
    return turn.as_matrix(), np.linalg.svd(turn.as_rotvec())[2]


@pytest.mark.parametrize("count", [5, 60])
@pytest.mark.parametrize("oblique", [0.0, 0.3, 1.0])
def test_axes_of_two_hinges_are_found(oblique, count):
    pair = np.array([[0.0, 0.6, 0.8], [0.0, 0.8 * np.cos(oblique), -0.6 * np.cos(oblique)]])
    pair[1, 0] = np.sin(oblique)
    D, principal = turned(pair, count)
    found = hinge_pair(principal, D)
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-14)
    assert follow(found, D)[1].max() < 1e-6
    if count == 60:  # of few rotations that hardly differ the axes are not determined
        assert np.abs(np.sum(found * pair, axis=1)) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_are_those_of_the_residuals(seed):
    W = Rotation.random(20, random_state=seed).as_matrix() - np.eye(3)
    x = np.random.default_rng(seed).normal(size=6)
    differences = [(residuals(x + 1e-6 * e, W) - residuals(x - 1e-6 * e, W)) / 2e-6 for e in np.eye(6)]
    assert derivatives(x, W) == pytest.approx(np.stack(differences, axis=1), abs=1e-8)
