import numpy as np
import pytest
from calmotion.retarget.curves import (
    interpolate,
    make_basis,
    make_grid,
    needed_pre_roll,
    sample_tracks,
)
from calmotion.shot import Track

FRAMES = np.arange(25) / 24.0


def test_grid_divides_frames_and_is_no_coarser_than_asked():
    grid = make_grid(FRAMES, 1 / 100, 0.31)
    assert grid.substeps == 5 and grid.h <= 1 / 100
    assert np.allclose(grid.times[grid.frames], FRAMES) and grid.pre_roll >= 0.31
    assert grid.times[0] == pytest.approx(-grid.pre_roll)


@pytest.mark.parametrize("pre_roll", [0.0, 0.5])
@pytest.mark.parametrize("kept", [False, True])
def test_offsets_sampled_at_frames_are_read_back_exactly(pre_roll, kept):
    """Input and offset together, as a layer would hold them."""
    rng = np.random.default_rng(0)
    grid = make_grid(FRAMES, 1 / 240, pre_roll)
    basis = make_basis(grid, 0.05, kept)
    track = Track(FRAMES, np.sin(2 * FRAMES) + FRAMES**2)
    p = rng.normal(size=basis.count)
    angles, rates = sample_tracks([track], grid)
    written = Track(FRAMES, angles[grid.frames, 0] + basis.at_frames @ p)
    read, read_rates = sample_tracks([written], grid)
    assert np.abs(read[:, 0] - angles[:, 0] - basis.values @ p).max() < 1e-12
    assert np.abs(read_rates[:, 0] - rates[:, 0] - basis.rates @ p).max() < 1e-10


def test_offset_rates_are_the_derivative_and_start_at_rest():
    grid = make_grid(FRAMES, 1 / 4800, 0.0)
    basis = make_basis(grid, 0.08, False)
    values, rates = basis.values.toarray(), basis.rates.toarray()
    difference = (values[2:] - values[:-2]) / (2 * grid.h)
    assert np.abs(difference - rates[1:-1]).max() < 1e-3 * np.abs(rates).max()
    assert np.abs(rates[0]).max() < 1e-12 and np.abs(rates[1]).max() < 1e-4 * np.abs(rates).max()
    assert np.allclose(values.sum(axis=1), 1.0)


@pytest.mark.parametrize("frames", [2, 3, 4, 5, 6, 7])
@pytest.mark.parametrize("pre_roll", [0.0, 0.25])
def test_short_shots_still_have_an_offset_that_can_be_written(frames, pre_roll):
    grid = make_grid(FRAMES[:frames], 1 / 240, pre_roll)
    basis = make_basis(grid, 0.05, False)
    assert basis.count >= 1 and np.allclose(basis.values.toarray()[grid.pre_steps :].sum(axis=1), 1.0)
    p = np.random.default_rng(3).normal(size=basis.count)
    written = Track(FRAMES[:frames], basis.at_frames @ p)
    read, _ = sample_tracks([written], grid)
    assert np.abs(read[grid.pre_steps :, 0] - (basis.values @ p)[grid.pre_steps :]).max() < 1e-12


def test_offsets_end_at_rest():
    rates = make_basis(make_grid(FRAMES, 1 / 240, 0.0), 0.05, False).rates.toarray()
    assert np.abs(rates[-1]).max() < 1e-10 and np.abs(rates[-2]).max() < 0.05 * np.abs(rates).max()


def test_kept_ends_leave_value_and_slope_there():
    grid = make_grid(FRAMES, 1 / 240, 0.0)
    basis = make_basis(grid, 0.08, True)
    for part in (basis.values.toarray(), basis.rates.toarray()):
        assert np.abs(part[[0, -1]]).max() < 1e-12


def test_pre_roll_leaves_rest_and_meets_the_curve_smoothly():
    grid = make_grid(FRAMES, 1 / 2400, 0.5)
    angles, rates = sample_tracks([Track(FRAMES, np.sin(3 * FRAMES + 0.4))], grid)
    n = grid.pre_steps
    assert abs(rates[0, 0]) < 1e-12
    assert np.abs(np.diff(angles[:, 0]) / grid.h - 0.5 * (rates[1:, 0] + rates[:-1, 0])).max() < 1e-4
    acceleration = np.diff(rates[:, 0]) / grid.h
    assert abs(acceleration[n] - acceleration[n - 1]) < 0.1 and abs(acceleration[0]) < 0.1


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
