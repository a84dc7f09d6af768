"""Parts of an animation: they have its values, and the busiest one holds its largest accelerations."""

import dataclasses

import numpy as np
from calmotion.model import Animation, Track
from calmotion.model.curves import held_curve
from calmotion.simulation.inputs.time_grid import busiest, later


def _animated(jerk_at):
    """A minute of slow swinging, with a quick move."""
    times = np.arange(60 * 24 + 1) / 24.0
    swing = 0.3 * np.sin(0.5 * times)
    tracks = (Track(times, swing + 0.2 * np.tanh(10.0 * (times - jerk_at))), Track(times, 0.1 * swing))
    return Animation(times, tracks, tracks)


def test_the_busiest_part_holds_the_quick_move_and_is_as_long_as_asked():
    for jerk_at in (3.0, 40.0, 58.0):
        whole = _animated(jerk_at)
        part = busiest(whole, 10.0)
        assert part.frame_times[0] == 0.0 and part.frame_times[-1] == 10.0
        start = float(whole.tracks[0].times[0] - part.tracks[0].times[0])
        assert start <= jerk_at <= start + 10.0 and 0.0 <= start <= 50.0
        at = np.linspace(0.0, 10.0, 77)
        for one, two in zip(whole.tracks, part.tracks, strict=True):
            np.testing.assert_allclose(held_curve(two, 10.0)(at, 0), held_curve(one, 60.0)(at + start, 0), atol=1e-9)


def test_a_shot_that_is_no_longer_is_its_own_part():
    whole = _animated(3.0)
    assert busiest(whole, 60.0) is whole and busiest(dataclasses.replace(whole, tracks=()), 10.0).tracks == ()
    assert busiest(dataclasses.replace(whole, frame_times=np.zeros(1)), 10.0).frame_times.tolist() == [0.0]


def test_from_the_beginning_only_the_frames_change():
    whole = _animated(3.0)
    part = later(whole, 0.0, whole.frame_times[:49])
    assert part.tracks is whole.tracks and part.frame_times[-1] == 2.0
