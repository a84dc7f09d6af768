"""Trails of the targets in the recording."""

import numpy as np
import synthetic
from calmotion.views.playback import sample_motion


def test_trails_end_at_the_target_and_show_its_last_moments_smoothly(columns):
    frames, result = synthetic.animation().frame_times, synthetic.result()
    times, trails = columns["/trails/input/Robot/Tip/Target", "LineStrips3D:strips"]
    np.testing.assert_allclose(times, frames, atol=2e-9)
    motion = result.before.motion
    places = np.stack([np.interp(frames, motion.times, x) for x in motion.target_positions[:, 0].T], axis=1)
    np.testing.assert_allclose([trail[-1][-1] for trail in trails], places, atol=1e-6)
    whole = np.array(trails[-1])
    np.testing.assert_allclose(whole[1:, 0], whole[:-1, -1], err_msg="pieces join")
    start = sample_motion(motion, frames[-1:] - 0.8).target_positions[0, 0]
    np.testing.assert_allclose(whole[0, 0], start, atol=1e-6)
    assert len({tuple(point) for piece in whole for point in piece}) > 2 * 0.8 * synthetic.FRAME_RATE
    colors = columns["/trails/input/Robot/Tip/Target", "LineStrips3D:colors"][1][0]
    fade = [abs((c >> 24) - 213) + abs((c >> 16 & 255) - 94) + abs(c >> 8 & 255) for c in colors]
    assert fade == sorted(fade, reverse=True) and fade[-1] < 3


def test_the_intended_trail_is_drawn_only_where_it_can_be_told_from_the_other(columns):
    result, frames = synthetic.result(), synthetic.animation().frame_times
    meant = sample_motion(result.reference, frames).target_positions[:, 0]
    drawn, off = {}, {}
    for root, run in (("input", result.before), ("optimized", result.after)):
        _, pieces = columns[f"/trails/reference/{root}/Robot/Tip/Target", "LineStrips3D:strips"]
        _, dots = columns[f"/trails/reference/{root}/Robot/Tip/Target/now", "Points3D:positions"]
        last = np.array([len(trail[-1]) > 0 for trail in pieces])
        np.testing.assert_array_equal(last, [len(dot) > 0 for dot in dots], err_msg="the dot ends its trail")
        drawn[root] = last
        off[root] = np.linalg.norm(sample_motion(run.motion, frames).target_positions[:, 0] - meant, axis=1)
    largest = off["input"].max()
    for root, last in drawn.items():
        assert last.any() and not last.all()
        assert off[root][~last].max() < 0.04 * largest and off[root][last].max() > 0.03 * largest
