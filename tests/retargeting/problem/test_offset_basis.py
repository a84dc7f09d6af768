"""Splines of the offsets: what they keep at the ends, and that samples at the frames hold them."""

import tracemalloc

import numpy as np
import pytest
from calmotion.model import Track
from calmotion.retargeting.problem.offset_basis import basis_on, make_basis
from calmotion.simulation.inputs.curves import sample_curves, sample_tracks
from calmotion.simulation.inputs.time_grid import make_grid

FRAMES = np.arange(25) / 24.0


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


@pytest.mark.parametrize("kept", [False, True])
def test_offsets_of_a_cyclic_shot_are_smooth_at_its_seam_and_read_back_exactly(kept):
    grid = make_grid(FRAMES, 1 / 240, 0.0, cyclic=True)
    basis = make_basis(grid, 0.1, kept)
    assert basis.wraps != kept
    first = grid.pre_steps
    for part in (basis.values, basis.rates, basis.accelerations):
        part = part.toarray()
        assert np.abs(part[[0, 1]] - part[[-2, -1]]).max() < 1e-9
        assert not kept or np.abs(part[first]).max() < 1e-9
    if not kept:
        assert np.allclose(basis.values.toarray().sum(axis=1), 1.0)
        assert np.allclose(basis.curvature_gram.toarray().sum(axis=1), 0.0, atol=1e-6), "a constant does not bend"
    p = np.random.default_rng(0).normal(size=basis.count)
    track = Track(FRAMES, np.sin(2 * np.pi * FRAMES))
    curves = sample_curves([track], grid)
    written = Track(FRAMES, curves.angles[grid.frames, 0] + basis.at_frames @ p)
    read = sample_curves([written], grid)
    assert np.abs(read.angles[:, 0] - curves.angles[:, 0] - basis.values @ p).max() < 1e-12
    assert np.abs(read.rates[:, 0] - curves.rates[:, 0] - basis.rates @ p).max() < 1e-10


@pytest.mark.parametrize("cyclic", [False, True])
def test_functions_act_within_their_support_alone(cyclic):
    grid = make_grid(FRAMES, 1 / 240, 0.5, cyclic)
    basis = make_basis(grid, 0.1, False)
    values, times = basis.values.toarray()[grid.judged], grid.times[grid.judged]
    for k, (first, last) in enumerate(basis.support):
        inside = (times >= first) & (times <= last)
        if cyclic:
            inside |= times >= first + 1.0
        assert np.abs(values[~inside, k]).max(initial=0.0) == 0.0 and np.abs(values[inside, k]).max() > 0.1


@pytest.mark.parametrize("cyclic", [False, True])
def test_knots_lie_where_they_are_wanted(cyclic):
    grid = make_grid(FRAMES, 1 / 240, 0.0, cyclic)
    breaks = np.array([0, 3, 4, 5, 6, 10, 17, 24], np.int32)
    basis = basis_on(grid, breaks, False)
    assert np.array_equal(basis.knots, FRAMES[breaks])
    # third derivatives change at the knots and nowhere else
    p = np.random.default_rng(1).normal(size=basis.count)
    third = np.diff(basis.accelerations[grid.pre_steps :] @ p) / grid.h
    jumps = np.flatnonzero(np.abs(np.diff(third)) > 1e-3 * np.abs(third).max()) + 1
    inner = set(np.round(FRAMES[breaks[1:-1]] / grid.h).astype(int))
    assert inner <= set(jumps) <= inner | {j + 1 for j in inner} | {j - 1 for j in inner}


def test_a_basis_of_ten_minutes_takes_memory_by_its_length_alone():
    """Dense, its values alone would have 5 GB; those within are those of a short shot at the same distance."""
    tracemalloc.start()
    try:
        grid = make_grid(np.arange(14401) / 24.0, 1 / 72, 0.0)
        basis = make_basis(grid, 0.05, False)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert basis.count > 14_000 and peak < 200e6
    short = make_basis(make_grid(np.arange(241) / 24.0, 1 / 72, 0.0), 0.05, False)
    for one, other in ((basis.values, short.values), (basis.rates, short.rates)):
        np.testing.assert_allclose(one[:300].toarray()[:, :100], other[:300].toarray()[:, :100], atol=1e-9)
    assert np.allclose(basis.values.sum(axis=1), 1.0)
