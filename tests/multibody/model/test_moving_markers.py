"""Moving markers of the world between two instants."""

import numpy as np
from calmotion.multibody.model.moving_markers import between, pack
from scipy.spatial.transform import Rotation


def marker(t):
    """Precession: a turn about one axis after a turn about another, along a curve; analytic, shape [T, 1, 18]."""
    t = np.asarray(t)
    position = np.stack([np.sin(2.0 * t), np.cos(3.0 * t), t**2], axis=1)
    velocity = np.stack([2.0 * np.cos(2.0 * t), -3.0 * np.sin(3.0 * t), 2.0 * t], axis=1)
    outer, inner = np.outer(2.0 * t, [0.0, 0.0, 1.0]), np.outer(1.5 * t, [1.0, 0.0, 0.0])
    second = Rotation.from_rotvec(inner)
    spin = second.inv().apply([0.0, 0.0, 2.0]) + [1.5, 0.0, 0.0]
    return pack(position, velocity, spin, (Rotation.from_rotvec(outer) * second).as_matrix())[:, None]


def test_it_is_of_fourth_order_and_its_rates_of_third():
    errors = []
    for h in (0.1, 0.05):
        exact = marker([0.3, 0.3 + h, 0.3 + 0.3 * h])
        found = between(exact[:2], h, 0.3)
        off = np.abs(found - exact[2])[0]
        errors.append([off[[0, 1, 2, *range(9, 18)]].max(), off[3:9].max()])
    orders = np.log2(np.divide(*errors))
    assert orders[0] > 3.7 and orders[1] > 2.7, (orders, errors)


def test_at_the_ends_it_is_what_is_given():
    world = marker([0.3, 0.4])
    for share, expected in ((0.0, world[0]), (1.0, world[1])):
        assert np.abs(between(world, 0.1, share) - expected).max() < 1e-12


def test_no_markers_are_no_work():
    assert between(np.zeros((2, 0, 18)), 0.1, 0.5).shape == (0, 18)


def test_a_contact_that_comes_in_a_step_holds_in_all_of_it():
    world = np.zeros((2, 3, 18))
    world[:, 0] = pack(np.zeros(3), np.ones(3), np.zeros(3), np.eye(3))
    world[1, 1] = pack(np.array([1.0, 2.0, 3.0]), np.zeros(3), np.zeros(3), np.eye(3))
    found = between(world, 0.1, 0.25)
    np.testing.assert_array_equal(found[1], world[1, 1])
    assert not np.any(found[2]) and np.any(found[0, :3] != 0.0)
