"""Motions sampled for pictures, and the points they carry."""

import numpy as np
import pytest
import synthetic
from calmotion.model import Body, Motion
from calmotion.support import rotation_from_quaternion
from calmotion.views.playback import carriers, deformed_points, deviations, relative_poses, sample_motion, world_points
from calmotion.views.raster import split_at_creases


def test_sampling_at_its_own_steps_returns_the_motion_itself():
    motion = synthetic.motion(synthetic.SHAKE)
    again = sample_motion(motion, motion.times)
    np.testing.assert_allclose(again.positions, motion.positions, atol=1e-14)
    np.testing.assert_allclose(again.rotations, motion.rotations, atol=1e-14)
    np.testing.assert_allclose(again.elastic[1], motion.elastic[1], atol=1e-14)


def test_sampling_between_steps_is_linear_and_keeps_rotations_of_unit_length():
    motion = synthetic.motion(synthetic.SHAKE)
    middle = 0.5 * (motion.times[:-1] + motion.times[1:])
    between = sample_motion(motion, middle)
    np.testing.assert_allclose(between.motor_values, 0.5 * (motion.motor_values[1:] + motion.motor_values[:-1]))
    np.testing.assert_allclose(np.linalg.norm(between.rotations, axis=-1), 1.0, atol=1e-14)


def test_a_quaternion_that_changes_sign_between_steps_is_the_same_rotation():
    motion = synthetic.motion(0.0)
    motion.rotations[1::2] *= -1.0
    between = sample_motion(motion, motion.times[:-1] + 0.5 * synthetic.STEP)
    plain = sample_motion(synthetic.motion(0.0), between.times)
    np.testing.assert_allclose(
        rotation_from_quaternion(between.rotations), rotation_from_quaternion(plain.rotations), atol=1e-12
    )


def test_outside_its_span_a_motion_is_constant():
    motion = synthetic.motion(synthetic.SHAKE)
    held = sample_motion(motion, np.array([-9.0, 99.0]))
    np.testing.assert_allclose(held.motor_values, motion.motor_values[[0, -1]])


def test_surface_points_move_with_the_modes_and_the_body():
    character, result = synthetic.character(), synthetic.result()
    motion = result.before.motion
    row = int(np.argmax(motion.elastic[1][:, 0]))
    points = world_points(character.bodies[1], 1, result.skins[1], motion, row)[0]
    tip = points[character.bodies[1].surfaces[0].points[:, 0] == synthetic.LENGTH].mean(axis=0)
    np.testing.assert_allclose(tip, motion.target_positions[row, 0], atol=1e-12)
    assert deformed_points(points, None, motion.elastic[1]).shape == (1, 8, 3)


def test_a_nested_body_is_placed_in_the_body_above_it():
    rng = np.random.default_rng(7)
    bodies = [Body(path, None, None) for path in ("/R/a/b/c", "/R/a", "/R/ab", "/R/a/x/d")]
    assert carriers(bodies) == [1, -1, -1, 1]
    q = rng.normal(size=(5, 2, 4))
    q /= np.linalg.norm(q, axis=2, keepdims=True)
    empty = np.zeros((5, 0))
    c = rng.normal(size=(5, 2, 3))
    motion = Motion(np.arange(5.0), c, q, (empty, empty), empty, empty, np.zeros((5, 0, 3)), np.zeros((5, 0, 4)))
    positions, rotations = relative_poses(motion, 0, 1)
    outer, inner = rotation_from_quaternion(q[:, 1]), rotation_from_quaternion(rotations)
    assert np.abs(outer @ inner - rotation_from_quaternion(q[:, 0])).max() < 1e-14
    assert np.abs(np.einsum("fij,fj->fi", outer, positions) + c[:, 1] - c[:, 0]).max() < 1e-14


def test_deviations_are_the_distances_of_the_points_at_each_row():
    rng = np.random.default_rng(3)
    points, modes = rng.normal(size=(5, 3)), rng.normal(size=(5, 3, 2))
    half = np.sqrt(0.5)

    def motion(turned, place, elastic):
        none = np.zeros((1, 0))
        return Motion(
            times=np.zeros(1),
            positions=np.array([[[0.0, 0.0, 0.0], place]]),
            rotations=np.array([[[1.0, 0.0, 0.0, 0.0], turned]]),
            elastic=(none, elastic),
            motor_values=none,
            motor_efforts=none,
            target_positions=np.zeros((1, 0, 3)),
            target_rotations=np.zeros((1, 0, 4)),
        )

    bent = np.array([[0.3, -0.2]])
    one = motion([half, 0.0, 0.0, half], [1.0, 2.0, 3.0], bent)  # a quarter turn about z: (x, y) to (-y, x)
    other = motion([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0], np.zeros((1, 0)))
    shape = points + modes @ bent[0]
    expected = np.stack([-shape[:, 1] + 1.0, shape[:, 0] + 2.0, shape[:, 2] + 3.0], axis=1) - points
    np.testing.assert_allclose(deviations(points, modes, 1, one, other)[0], np.linalg.norm(expected, axis=1))


def test_a_box_has_three_normals_at_each_corner_and_keeps_its_shape():
    points, triangles = synthetic.box((0, 0, 0), (1, 2, 3))
    sources, split, normals = split_at_creases(points, triangles)
    assert np.bincount(sources).tolist() == [3] * 8
    assert np.array_equal(sources[split], triangles)
    faces = np.cross(*(points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2)))
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    for corner in range(3):
        np.testing.assert_allclose(normals[split[:, corner]], faces, atol=1e-12)


def test_a_round_tube_stays_smooth_around_and_sharp_at_its_end():
    count = 24
    angle = 2.0 * np.pi * np.arange(count) / count
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.vstack([np.column_stack([ring, np.full(count, z)]) for z in (0.0, 1.0)] + [[0.0, 0.0, 1.0]])
    triangles = []
    for k in range(count):
        after = (k + 1) % count
        triangles += [(k, after, count + after), (k, count + after, count + k), (2 * count, count + k, count + after)]
    sources, _, normals = split_at_creases(points, np.array(triangles, dtype=np.int32))
    assert np.bincount(sources).tolist() == [1] * count + [2] * count + [1]
    side = normals[sources < count]
    np.testing.assert_allclose(side[:, :2], points[sources[sources < count]][:, :2], atol=0.1)
    assert np.abs(side[:, 2]).max() == pytest.approx(0.0)
