"""The viewpoint sees what moves, from the side it moves on."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import synthetic
from calmotion.views.viewpoint import choose_viewpoint, eye_that_sees, hull_corners, moving_cloud, near_scenery


def test_the_sphere_contains_every_target_but_not_the_hidden_guide():
    result = synthetic.result()
    motion = result.before.motion
    view = choose_viewpoint(synthetic.character(), result.skins, motion)
    assert np.linalg.norm(motion.target_positions[:, 0] - view.center, axis=1).max() <= view.radius
    assert view.radius < 0.6


def test_it_looks_from_the_side_of_the_targets_and_from_above():
    result = synthetic.result()
    view = choose_viewpoint(synthetic.character(), result.skins, result.before.motion)
    assert view.toward_eye @ result.reference.target_positions[:, 0].mean(axis=0) > 0.0
    assert view.toward_eye @ view.up == pytest.approx(np.sin(np.radians(17.0)))
    assert np.linalg.norm(view.toward_eye) == pytest.approx(1.0)


def test_without_gravity_or_targets_there_is_still_a_view():
    result = synthetic.result()
    motion = dataclasses.replace(result.reference, target_positions=np.zeros((len(result.reference.times), 0, 3)))
    character = dataclasses.replace(synthetic.character(), gravity=np.zeros(3), targets=())
    view = choose_viewpoint(character, result.skins, motion)
    assert np.all(np.isfinite(view.toward_eye)) and np.linalg.norm(view.toward_eye) == pytest.approx(1.0)


def test_the_eye_is_as_near_as_the_whole_motion_allows():
    character, result = synthetic.character(), synthetic.result()
    motion = result.before.motion
    view = choose_viewpoint(character, result.skins, motion)
    cloud = moving_cloud(character, result.skins, motion)
    assert np.linalg.norm(cloud, axis=1).max() > synthetic.LENGTH
    half, aspect = np.radians(24.0), 1.3
    eye, look = eye_that_sees(view, cloud, half, aspect)
    forward = (look - eye) / np.linalg.norm(look - eye)
    np.testing.assert_allclose(forward, -view.toward_eye, atol=1e-9)
    right = np.cross(forward, view.up) / np.linalg.norm(np.cross(forward, view.up))
    offset = cloud - eye
    depth = offset @ forward
    assert depth.min() > 0.0
    across = np.abs(offset @ right) / depth / (aspect * np.tan(half))
    upright = np.abs(offset @ np.cross(right, forward)) / depth / np.tan(half)
    assert max(across.max(), upright.max()) == pytest.approx(1.0), "inside the picture, and reaching its edge"


def test_of_a_flat_surface_all_points_are_taken():
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 0.0]])
    assert hull_corners(flat).tolist() == [0, 1, 2, 3, 4]


def test_scenery_near_the_character_belongs_into_the_picture_and_a_stage_does_not():
    character = synthetic.character()
    surface = next(surface for body in character.bodies for surface in body.surfaces if surface.drawn)
    cloud = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])

    def box(low, high):
        points = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
        return dataclasses.replace(surface, points=points)

    head, stage = box((0.4, 0.4, 1.0), (0.6, 0.6, 1.2)), box((-3.0, -3.0, -0.1), (3.0, 3.0, 0.0))
    lamp = box((0.4, 0.4, 1.3), (0.6, 0.6, 1.6))  # no longer fits beside the head
    hidden = dataclasses.replace(box((0.0, 0.0, 0.0), (0.1, 0.1, 0.1)), visible=False)
    near = near_scenery(dataclasses.replace(character, scenery=(stage, lamp, head, hidden)), cloud)
    np.testing.assert_array_equal(np.sort(near, axis=0), np.sort(head.points, axis=0))
    table = box((0.2, -0.5, 0.0), (0.8, 1.2, 0.3))  # the picture would cut it, and has the greater part of it
    near = near_scenery(dataclasses.replace(character, scenery=(stage, table)), cloud)
    np.testing.assert_array_equal(np.sort(near, axis=0), np.sort(table.points, axis=0))
    assert near_scenery(dataclasses.replace(character, scenery=()), cloud).shape == (0, 3)
