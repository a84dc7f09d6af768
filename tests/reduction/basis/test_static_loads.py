"""Unit accelerations, and their peaks."""

import numpy as np
from calmotion.reduction.basis.static_loads import peak_loads, unit_accelerations
from calmotion.reduction.load_envelope import LoadEnvelope, load_direction_envelope, patch_load_envelope


def an_excitation(rng, rows=2):
    return LoadEnvelope(*rng.random((3, 3)), rng.random((rows, 3)), rng.random((rows, 3)), 7.0, rng.random(rows))


def test_unit_accelerations_make_up_the_acceleration_of_any_rigid_motion():
    rng = np.random.default_rng(0)
    nodes, (a, alpha, w) = rng.normal(size=(20, 3)), rng.normal(size=(3, 3))
    products = [w[0] ** 2, w[1] ** 2, w[2] ** 2, w[1] * w[2], w[0] * w[2], w[0] * w[1]]
    field = unit_accelerations(nodes) @ np.concatenate([a, alpha, products])
    expected = a + np.cross(alpha, nodes) + np.cross(w, np.cross(w, nodes))
    assert np.allclose(field, expected, rtol=0, atol=1e-13)


def test_peaks_are_in_the_order_of_the_accelerations_then_wrench_by_wrench():
    item = an_excitation(np.random.default_rng(1))
    peaks = peak_loads(item)
    w = item.angular_velocity
    assert np.allclose(peaks[:6], np.concatenate([item.acceleration, item.angular_acceleration]))
    assert np.allclose(peaks[6:12], [w[0] ** 2, w[1] ** 2, w[2] ** 2, w[1] * w[2], w[0] * w[2], w[0] * w[1]])
    assert np.allclose(peaks[12:18], np.concatenate([item.force[0], item.moment[0]]))
    assert np.allclose(peaks[18:], np.concatenate([item.force[1], item.moment[1]]))


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
