"""The grid of a shot, its pre-roll, and loops that get up to speed."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import Animation, Character, Motor, Track
from calmotion.model.animation import Schedule
from calmotion.model.curves import held_curve
from calmotion.simulation.inputs.curves import sample_curves, sample_tracks
from calmotion.simulation.inputs.time_grid import busiest, later, make_grid

FRAMES = np.arange(25) / 24.0
STILL = Character("/R", (), (), (), (), np.zeros(3))


def test_grid_divides_frames_and_is_not_coarser_than_requested():
    grid = make_grid(FRAMES, 1 / 100, 0.31)
    assert grid.substeps == 5 and grid.h <= 1 / 100
    assert np.allclose(grid.times[grid.frames], FRAMES) and grid.pre_roll >= 0.31
    assert grid.times[0] == pytest.approx(-grid.pre_roll)


def test_pre_roll_leaves_rest_and_meets_the_curve_smoothly():
    grid = make_grid(FRAMES, 1 / 2400, 0.5)
    angles, rates = sample_tracks([Track(FRAMES, np.sin(3 * FRAMES + 0.4))], grid)
    n = grid.pre_steps
    assert abs(rates[0, 0]) < 1e-12
    assert np.abs(np.diff(angles[:, 0]) / grid.h - 0.5 * (rates[1:, 0] + rates[:-1, 0])).max() < 1e-4
    acceleration = np.diff(rates[:, 0]) / grid.h
    assert abs(acceleration[n] - acceleration[n - 1]) < 0.1 and abs(acceleration[0]) < 0.1


def test_a_cycle_starts_from_the_last_instant_of_the_previous_one_and_counts_its_first_frame_once():
    grid = make_grid(FRAMES, 1 / 240, 0.0, cyclic=True)
    assert np.allclose(grid.times[:3], [-grid.h, 0.0, grid.h]) and np.allclose(grid.times[grid.frames], FRAMES)
    assert grid.quadrature.sum() == pytest.approx(grid.end) and np.all(grid.quadrature[:2] == 0.0)
    curves = sample_curves([Track(FRAMES, np.sin(2 * np.pi * FRAMES + 0.4))], grid)
    for part in (curves.angles, curves.rates, curves.accelerations):
        assert np.abs(part[:2] - part[-2:]).max() < 1e-9
    once = make_grid(FRAMES, 1 / 240, 0.5)
    assert once.quadrature.sum() == pytest.approx(once.end) and not once.judged[once.pre_steps - 1]


def _animated(jerk_at):
    """A minute of slow swinging, with a quick move."""
    times = np.arange(60 * 24 + 1) / 24.0
    swing = 0.3 * np.sin(0.5 * times)
    tracks = (Track(times, swing + 0.2 * np.tanh(10.0 * (times - jerk_at))), Track(times, 0.1 * swing))
    return Animation(times, tracks, tracks)


def test_the_busiest_part_holds_the_quick_move_and_is_as_long_as_asked():
    for jerk_at in (3.0, 40.0, 58.0):
        whole = _animated(jerk_at)
        part = busiest(STILL, whole, 10.0)
        assert part.frame_times[0] == 0.0 and part.frame_times[-1] == 10.0
        start = float(whole.tracks[0].times[0] - part.tracks[0].times[0])
        assert start <= jerk_at <= start + 10.0 and 0.0 <= start <= 50.0
        at = np.linspace(0.0, 10.0, 77)
        for one, two in zip(whole.tracks, part.tracks, strict=True):
            np.testing.assert_allclose(held_curve(two, 10.0)(at, 0), held_curve(one, 60.0)(at + start, 0), atol=1e-9)


def test_a_shot_that_is_no_longer_is_its_own_part():
    whole = _animated(3.0)
    cyclic = dataclasses.replace(STILL, retarget=dataclasses.replace(STILL.retarget, cyclic=True))
    assert busiest(STILL, whole, 60.0) is whole and busiest(cyclic, whole, 10.0) is whole
    assert busiest(STILL, dataclasses.replace(whole, tracks=()), 10.0).tracks == ()
    assert busiest(STILL, dataclasses.replace(whole, frame_times=np.zeros(1)), 10.0).frame_times.tolist() == [0.0]


def test_a_shot_with_a_motor_that_is_switched_is_its_own_part():
    whole, held = _animated(40.0), Schedule(np.array([0.0, 39.0]), np.array([True, False]))
    switched = dataclasses.replace(STILL, motors=(Motor(0, "/R/Joint", "drive", powered=held),))
    assert busiest(switched, whole, 10.0) is whole


def test_from_the_beginning_only_the_frames_change():
    whole = _animated(3.0)
    part = later(whole, 0.0, whole.frame_times[:49])
    assert part.tracks is whole.tracks and part.frame_times[-1] == 2.0
