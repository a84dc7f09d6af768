"""The viewpoint sees what moves, from the side it moves on."""

import dataclasses

import numpy as np
import pytest
import synthetic
from calmotion.views.playback import sample_motion
from calmotion.views.viewpoint import choose_viewpoint, eye_that_sees, framed, hull_corners, moving_cloud


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


def test_a_swing_of_a_tenth_of_a_second_stays_in_the_picture():
    character, result = synthetic.character(), synthetic.result()
    times = np.linspace(0.0, 4.0, 481)
    still = dataclasses.replace(sample_motion(result.reference, np.zeros(len(times))), times=times)
    lifted = still.positions.copy()
    lifted[300:313, 2, 2] += 1.0
    cloud = moving_cloud(character, result.skins, dataclasses.replace(still, positions=lifted))
    assert cloud[:, 2].max() > 1.0


def test_of_a_flat_surface_all_points_are_taken():
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 0.0]])
    assert hull_corners(flat).tolist() == [0, 1, 2, 3, 4]


@pytest.mark.parametrize(
    ("low", "high", "shown"),
    [
        ((0.2, 0.2, 0.0), (0.3, 0.3, 0.2), True),  # a lamp beside the robot
        ((0.2, 0.2, 0.6), (0.3, 0.3, 1.0), False),  # far above it
        ((-0.1, -0.1, 0.0), (0.7, 0.7, 0.02), True),  # a table, of which the picture would cut the edge
        ((-0.1, -0.1, -0.22), (0.7, 0.7, -0.2), False),  # a floor of that size
        ((-3.0, -3.0, -0.3), (3.0, 3.0, -0.25), False),  # a stage
    ],
)
def test_what_stands_still_is_in_the_picture_where_it_is_near_or_would_be_cut(low, high, shown):
    character, result = synthetic.character(), synthetic.result()
    base = character.bodies[0].surfaces[0]
    piece = dataclasses.replace(base, points=synthetic.box(low, high)[0])
    view = choose_viewpoint(character, result.skins, result.reference)

    def corners(scenery):
        points = framed(view, dataclasses.replace(character, scenery=scenery), result.skins, (result.reference,))
        return {tuple(corner) for corner in points}

    alone = corners(())
    assert {tuple(corner) for corner in base.points} <= alone, "what carries the robot"
    assert corners((piece,)) - alone == ({tuple(corner) for corner in piece.points} if shown else set())
    assert corners((dataclasses.replace(piece, visible=False),)) == alone
