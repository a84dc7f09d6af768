"""Unit accelerations, and their peaks."""

import numpy as np
from calmotion.reduction.load_envelope import (
    LoadEnvelope,
    directed_load_envelope,
    load_direction_envelope,
    patch_load_envelope,
)


def an_excitation(rng, rows=2):
    return LoadEnvelope(*rng.random((3, 3)), rng.random((rows, 3)), rng.random((rows, 3)), 7.0, rng.random(rows))


def test_wrenches_of_a_patch_bound_those_of_its_interfaces_together():
    rng = np.random.default_rng(2)
    item, positions = an_excitation(rng, 3), rng.normal(size=(3, 3))
    center = positions[1]
    patches = patch_load_envelope(item, [(1, 2), (0,)], positions, [center, positions[0]])
    assert np.allclose(patches.force[1], item.force[0]) and np.allclose(patches.moment[1], item.moment[0])
    assert (
        np.allclose(patches.target_distance, [item.target_distance[1:].max(), item.target_distance[0]])
        and patches.frequency == 7.0
    )
    largest = np.zeros(6)
    for _ in range(4000):
        wrench = np.zeros(6)
        for i in (1, 2):
            f, m = rng.choice([-1, 1], size=(2, 3)) * [item.force[i], item.moment[i]]
            wrench += np.concatenate([f, m + np.cross(positions[i] - center, f)])
        largest = np.maximum(largest, np.abs(wrench))
    assert np.allclose(np.concatenate([patches.force[0], patches.moment[0]]), largest)


def test_a_rotated_body_gets_components_of_every_load_in_all_directions():
    force, moment = np.array([[3.0, 4.0, 0.0]]), np.array([[0.0, 0.0, 2.0]])
    item = LoadEnvelope(np.array([0.0, 9.81, 0.0]), np.zeros(3), np.array([0.0, 5.0, 0.0]), force, moment)
    found = load_direction_envelope(item, 0.1, 0.2)
    assert np.allclose(found.acceleration, [0.981, 9.81, 0.981]) and np.allclose(found.angular_velocity, [0.5, 5, 0.5])
    assert np.allclose(found.force, [[3.0, 4.0, 0.5]])
    # the force has moved aside by 0.1 of 0.2 m; a tenth of the moment is more
    assert np.allclose(found.moment, [[0.2, 0.2, 2.0]])
    assert np.allclose(load_direction_envelope(item, 7.0, 0.2).force, 5.0)  # no more than all of it
    assert np.array_equal(load_direction_envelope(item, 0.0, 0.2).force, force)


def test_a_flexible_robot_tells_directions_and_no_smaller_loads():
    rigid = LoadEnvelope(np.array([0.0, 9.81, 0.0]), *np.zeros((2, 3)), np.array([[3.0, 0.0, 0.0]]), np.zeros((1, 3)))
    flexible = LoadEnvelope(np.array([0.0, 9.0, 0.4]), *np.zeros((2, 3)), np.array([[8.0, 0.2, 0.0]]), np.ones((1, 3)))
    found = directed_load_envelope(rigid, flexible, 2.0)
    assert np.allclose(found.acceleration, [0.0, 9.81, 0.2]) and np.allclose(found.force, [[4.0, 0.1, 0.0]])
    assert np.allclose(found.moment, 0.5) and found.directed and not rigid.directed
