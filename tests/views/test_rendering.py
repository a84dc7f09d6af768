"""Pictures of a character: camera, poses, scenery, shadow, and the outline of the intended motion."""

import dataclasses

import numpy as np
import pytest
import synthetic
from calmotion.model import SurfaceMesh
from calmotion.views.rendering import (
    View,
    draw_over_ghost,
    fit_camera,
    floor_below,
    ghost_of,
    pose,
    prepare,
    see,
    with_picture,
)
from calmotion.views.viewpoint import choose_viewpoint


def test_the_camera_shows_the_whole_motion_and_up_is_up():
    character, result = synthetic.character(), synthetic.result()
    motion = result.before.motion
    view = choose_viewpoint(character, result.skins, motion)
    cloud = motion.target_positions[:, 0]
    camera = fit_camera(view, cloud, 300, 200)
    pixels = camera.project(cloud)
    assert np.all(pixels[:, :2] >= 0.0) and np.all(pixels[:, :2] <= [300, 200])
    low, high = camera.project(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]))
    assert high[1] < low[1]
    # Seen from its side of the world, what is nearer has the smaller depth.
    assert camera.project(camera.eye + camera.axes[2])[2] == pytest.approx(1.0)


def test_the_bent_link_is_drawn_where_the_simulation_puts_it():
    character, result = synthetic.character(), synthetic.result()
    model = prepare(character, result.skins)
    row = int(np.argmax(result.before.motion.elastic[1][:, 0]))
    corners, normals, owners = pose(model, result.before.motion, row)
    link = corners[owners == 1].reshape(-1, 3)
    far = np.linalg.norm(link, axis=1) > 0.9 * synthetic.LENGTH
    np.testing.assert_allclose(
        np.unique(link[far].round(9), axis=0).mean(axis=0), result.before.motion.target_positions[row, 0], atol=1e-6
    )
    assert len(model.parts) == 3  # the guide is not shown
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0)


@pytest.fixture(scope="module")
def seen():
    """The synthetic character with a red wall before its link, and its camera."""
    character, result = synthetic.character(), synthetic.result()
    view = choose_viewpoint(character, result.skins, result.before.motion)
    camera = fit_camera(view, result.before.motion.target_positions[:, 0], 120, 90, 0.3)
    right, down, forward = camera.axes
    at = result.before.motion.target_positions[-1, 0] - 0.05 * forward
    points = np.array([at + 0.04 * (x * right + y * down) for x, y in ((-1, -1), (-1, 1), (1, 1), (1, -1))])
    wall = SurfaceMesh("/Wall", points, np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32), (1.0, 0.0, 0.0))
    return dataclasses.replace(character, scenery=(wall,)), result, camera


def test_scenery_is_drawn_and_hides_what_is_behind_it(seen):
    character, result, camera = seen
    model, row = prepare(character, result.skins), len(result.before.motion.times) - 1
    surface = see(View(model, result.before.motion, result.reference, row, camera, 1), result.before.motion).surface
    x, y = camera.project(result.before.motion.target_positions[row, 0])[:2].astype(int)
    assert surface[y, x] == len(model.parts), "the wall stands before the target"
    bare = prepare(dataclasses.replace(character, scenery=()), result.skins)
    surface = see(View(bare, result.before.motion, result.reference, row, camera, 1), result.before.motion).surface
    assert 0 <= surface[y, x] < len(bare.parts)


def test_a_motion_that_is_the_intended_one_has_no_outline(seen):
    character, result, camera = seen
    model = prepare(dataclasses.replace(character, scenery=()), result.skins)
    view = View(model, result.before.motion, result.before.motion, 60, camera, 1)
    green = draw_over_ghost(view).astype(int)
    assert not np.any(green[..., 1] > green[..., 0] + 30)
    shaken = dataclasses.replace(view, reference=result.reference, camera=dataclasses.replace(camera, scale=6e2))
    assert result.before.position_errors[60, 0] > 5e-3
    place = camera.project(result.reference.target_positions[60, 0])[:2]
    center = np.array(camera.size) / 2 - 6e2 / camera.scale * (place - camera.center)
    near = draw_over_ghost(dataclasses.replace(shaken, camera=dataclasses.replace(shaken.camera, center=center)))
    assert np.any(near[..., 1].astype(int) > near[..., 0].astype(int) + 30)


def test_the_shadow_falls_on_the_floor_and_on_what_lies_there(seen):
    character, result, camera = seen
    model = prepare(dataclasses.replace(character, scenery=()), result.skins)
    floor = floor_below(model, result.reference)
    assert floor == pytest.approx(min(float(pose(model, result.reference, 0)[0][..., 2].min()), 0.0))
    view = View(model, result.before.motion, result.before.motion, 60, camera, 1)
    plain, dark = (draw_over_ghost(dataclasses.replace(view, floor=height)) for height in (None, floor - 0.05))
    darker = dark.astype(int).sum(axis=-1) < plain.astype(int).sum(axis=-1)
    assert darker.any() and not np.any(darker & see(view, view.motion).hits.filled)


def test_a_pose_before_scenery_that_was_drawn_is_the_same_picture(seen):
    character, result, camera = seen
    view = View(prepare(character, result.skins), result.before.motion, result.reference, 60, camera, 2, floor=-0.1)
    backdrop = see(view, None)
    ghost = ghost_of(view, backdrop)
    for before in (backdrop, with_picture(view, backdrop)):
        np.testing.assert_array_equal(draw_over_ghost(view, before, ghost), draw_over_ghost(view))
