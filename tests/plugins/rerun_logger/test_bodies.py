"""Bodies in the recording: meshes, motion, colours and ghosts."""

import numpy as np
import pytest
import synthetic
from calmotion.views.playback import sample_motion, world_points


def test_every_visible_mesh_is_there_once_for_each_motion_under_its_prim_path(columns):
    meshes = sorted(entity for entity, name in columns if name == "Mesh3D:triangle_indices")
    moving = ["/Robot/Link/Beam", "/Robot/Tip/Ball"]
    expected = [f"/{root}{mesh}" for root in ("input", "optimized") for mesh in ["/Robot/Base/Box", *moving]]
    # What is never off has no ghost, and guide geometry is not shown.
    ghosts = [f"/reference/{root}{mesh}" for root in ("input", "optimized") for mesh in moving]
    assert meshes == sorted(expected + ghosts)
    for mesh in meshes:
        times, values = columns[mesh, "Mesh3D:triangle_indices"]
        assert times is None and len(values) == 1 and len(values[0]) == 12


def test_bodies_move_at_the_frames_of_the_shot_and_never_before_them(columns):
    result = synthetic.result()
    frames = synthetic.animation().frame_times
    for root, motion in (
        ("input", result.before.motion),
        ("optimized", result.after.motion),
        ("reference/input", result.reference),
        ("reference/optimized", result.reference),
    ):
        times, places = columns[f"/{root}/Robot/Tip", "Transform3D:translation"]
        np.testing.assert_allclose(times, frames, atol=2e-9)
        expected = [np.interp(frames, motion.times, motion.positions[:, 2, axis]) for axis in range(3)]
        np.testing.assert_allclose(np.array(places)[:, 0], np.transpose(expected), atol=1e-6)
        quaternion = np.array(columns[f"/{root}/Robot/Link", "Transform3D:quaternion"][1])[:, 0]
        angle = 2.0 * np.arctan2(quaternion[:, 2], quaternion[:, 3])
        np.testing.assert_allclose(angle, np.interp(frames, motion.times, motion.motor_values[:, 0]), atol=1e-5)


def test_vertices_of_a_flexible_body_follow_its_modes_and_rigid_ones_stay(columns):
    result = synthetic.result()
    frames = synthetic.animation().frame_times
    times, shapes = columns["/input/Robot/Link/Beam", "Mesh3D:vertex_positions"]
    np.testing.assert_allclose(times, frames, atol=2e-9)
    shapes = np.array(shapes)
    assert shapes.shape == (len(frames), 24, 3)  # a box has three normals at each of its eight corners
    tip = np.isclose(shapes[0, :, 0], synthetic.LENGTH)
    bend = np.interp(frames, result.before.motion.times, result.before.motion.elastic[1][:, 0])
    middle = shapes[:, tip, 1].mean(axis=1)
    np.testing.assert_allclose(middle, bend, atol=1e-6)
    assert np.abs(bend).max() > 0.02
    np.testing.assert_allclose(shapes[:, ~tip], np.broadcast_to(shapes[0, ~tip], shapes[:, ~tip].shape), atol=1e-7)
    times, shapes = columns["/input/Robot/Tip/Ball", "Mesh3D:vertex_positions"]
    assert times is None and len(shapes) == 1


def test_what_is_off_takes_the_color_of_the_input_and_what_is_not_keeps_its_own(columns):
    result, frames = synthetic.result(), synthetic.animation().frame_times
    character = synthetic.character()
    motions = [sample_motion(motion, frames) for motion in (result.before.motion, result.reference)]

    def off(body):
        places = [
            np.array(
                [world_points(character.bodies[body], body, result.skins[body], m, k)[0] for k in range(len(frames))]
            )
            for m in motions
        ]
        return np.linalg.norm(places[0] - places[1], axis=2)

    scale = max(off(body).max() for body in range(len(character.bodies)))
    times, colors = columns["/input/Robot/Tip/Ball", "Mesh3D:vertex_colors"]
    np.testing.assert_allclose(times, frames, atol=2e-9)
    found = np.array([[(c >> 24, c >> 16 & 255, c >> 8 & 255) for c in row] for row in colors], dtype=float)
    own, strongest = found[0].min(axis=0), np.array([213.0, 94.0, 0.0])
    share = off(2).mean(axis=1) / scale
    expected = own + share[:, None] * (strongest - own)
    assert share.max() > 0.8 and np.abs(found.mean(axis=1) - expected).max() < 3.0
    assert ("/input/Robot/Tip/Ball", "Mesh3D:albedo_factor") not in columns, "it would be multiplied in"
    assert ("/input/Robot/Base/Box", "Mesh3D:albedo_factor") in columns, "what stands still is never off"
    assert ("/input/Robot/Base/Box", "Mesh3D:vertex_colors") not in columns


@pytest.mark.parametrize("root", ["input", "optimized"])
def test_the_ghost_is_seen_only_while_its_body_is_off(columns, root):
    result, frames, character = synthetic.result(), synthetic.animation().frame_times, synthetic.character()
    run = {"input": result.before, "optimized": result.after}[root]
    motions = [sample_motion(motion, frames) for motion in (run.motion, result.before.motion, result.reference)]
    places = [
        np.array([world_points(character.bodies[2], 2, result.skins[2], motion, k)[0] for k in range(len(frames))])
        for motion in motions
    ]
    off, most = (np.linalg.norm(place - places[2], axis=2).max(axis=1) for place in places[:2])
    times, colors = columns[f"/reference/{root}/Robot/Tip/Ball", "Mesh3D:albedo_factor"]
    np.testing.assert_allclose(times, frames, atol=2e-9)
    opacity = np.array([row[0] & 255 for row in colors])
    assert np.all(opacity[off < 0.11 * most.max()] == 0) and np.all(opacity[off > 0.31 * most.max()] == 90)
    assert np.all(np.diff(opacity[np.argsort(off)]) >= 0)
