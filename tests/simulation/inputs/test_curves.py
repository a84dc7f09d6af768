"""Tracks as smooth curves, played once and in a loop."""

import numpy as np
import pytest
from calmotion.model import Track
from calmotion.model.curves import curve_of, cycle_gap, cyclic_curve, interpolate
from calmotion.simulation.inputs.curves import needed_pre_roll, sample_tracks
from calmotion.simulation.inputs.time_grid import make_grid

FRAMES = np.arange(25) / 24.0


def test_pre_roll_is_only_for_shots_that_start_in_motion():
    still = np.where(FRAMES < 0.2, 0.0, (FRAMES - 0.2) ** 3)
    assert needed_pre_roll([Track(FRAMES, still)], FRAMES) == 0.0
    assert needed_pre_roll([Track(FRAMES, still), Track(FRAMES, 0.1 * FRAMES)], FRAMES) > 0.0


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6])
def test_sparse_tracks_are_interpolated_and_held(count):
    times = np.linspace(0.25, 0.75, count)
    values = np.linspace(1.0, 2.0, count)
    spline = interpolate(Track(times, values), FRAMES[-1])
    assert np.allclose(spline(times), values)
    angles, rates = sample_tracks([Track(times, values)], make_grid(FRAMES, None, 0.0))
    assert angles[0, 0] == pytest.approx(values[0]) and angles[-1, 0] == pytest.approx(values[-1])
    assert rates[0, 0] == 0.0 and rates[-1, 0] == 0.0


def test_a_cyclic_curve_is_smooth_at_its_seam_also_with_whole_revolutions():
    values = 0.3 * np.sin(2 * np.pi * FRAMES + 0.7) + 4 * np.pi * FRAMES
    curve = cyclic_curve(Track(FRAMES, values), FRAMES[-1])
    assert np.allclose(curve(FRAMES, 0), values)
    for order in range(3):
        before, after = curve(np.array([1.0 - 1e-9]), order), curve(np.array([1.0 + 1e-9]), order)
        assert np.abs(after - before) < 1e-5
    assert np.allclose(curve(FRAMES + 3.0, 0), values + 3 * 4 * np.pi)
    assert np.allclose(curve(FRAMES, 1), curve(FRAMES - 2.0, 1))


def test_sparse_samples_of_a_cyclic_shot_are_completed_at_its_ends():
    for times in (np.array([0.5]), np.array([0.25, 0.75]), np.array([-0.2, 0.4, 1.3])):
        track = Track(times, np.cos(2 * np.pi * times))
        curve = cyclic_curve(track, 1.0)
        inside = times[(times >= 0.0) & (times <= 1.0)]
        assert np.allclose(curve(inside, 0), np.cos(2 * np.pi * inside))
        assert np.allclose(curve(np.array([0.0]), 0), curve(np.array([1.0]), 0))


def test_chains_that_do_not_close_are_noticed():
    almost = Track(FRAMES, FRAMES * (2 * np.pi + 0.01))
    assert cycle_gap(almost, 1.0, turning=True) == pytest.approx(0.01)
    assert cycle_gap(almost, 1.0, turning=False) == pytest.approx(2 * np.pi + 0.01)


def test_a_corner_is_kept_and_the_rest_is_smooth():
    values = np.where(FRAMES < 0.5, FRAMES**2, 0.25 - 2.0 * (FRAMES - 0.5))
    curve = curve_of(Track(FRAMES, values, np.array([0.5])), 1.0, False)
    fine = np.linspace(0.0, 1.0, 501)
    assert np.allclose(curve(fine, 0), np.where(fine < 0.5, fine**2, 0.25 - 2.0 * (fine - 0.5)), atol=1e-12)
    assert curve(np.array([0.5 - 1e-9]), 1) == pytest.approx(1.0) and curve(np.array([0.5]), 1) == pytest.approx(-2.0)
    rounded = curve_of(Track(FRAMES, values), 1.0, False)
    assert np.abs(rounded(fine, 0) - curve(fine, 0)).max() > 1e-3, "without it the corner would be rounded"


def test_constant_parts_before_and_after_corners_are_at_rest():
    track = Track(np.array([0.25, 0.5, 0.75]), np.array([0.0, 1.0, 0.0]), np.array([0.5]))
    curve = curve_of(track, 1.0, False)
    assert np.allclose(curve(np.array([0.0, 0.1, 0.9, 1.0]), 1), 0.0)
    assert np.allclose(curve(track.times, 0), track.values)


def test_a_cyclic_curve_keeps_its_corners():
    values = np.abs(FRAMES - 0.5)
    curve = curve_of(Track(FRAMES, values, np.array([0.5])), 1.0, True)
    fine = np.linspace(0.3, 0.7, 201)
    assert np.allclose(curve(fine, 0), np.abs(fine - 0.5), atol=1e-3)
    assert np.allclose(curve(fine + 2.0, 0), curve(fine, 0))
    across = curve(np.array([1.0 - 1e-9, 1.0 + 1e-9]), 1)
    assert np.abs(np.diff(across)) < 1e-5, "its seam is no corner"


def test_a_shot_without_motors_has_no_curves():
    angles, rates = sample_tracks([], make_grid(FRAMES, None, 0.0))
    assert angles.shape == rates.shape == (len(make_grid(FRAMES, None, 0.0).times), 0)
