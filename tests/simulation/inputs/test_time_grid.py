"""The grid of a shot, its pre-roll, and loops that get up to speed."""

import numpy as np
import pytest
from calmotion.model import Track
from calmotion.simulation.inputs.curves import sample_curves, sample_tracks
from calmotion.simulation.inputs.time_grid import make_grid

FRAMES = np.arange(25) / 24.0


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
