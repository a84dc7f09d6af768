"""Parts of a shot: offsets that frames hold exactly, and bases whose splines vanish where windows meet."""

from types import SimpleNamespace

import numpy as np
import pytest
from calmotion.retargeting.problem.offset_basis import basis_on, uniform_breaks
from calmotion.retargeting.problem.offset_space import BaseOffsets, OffsetSpace
from calmotion.retargeting.windows.parts import Part, offset_curves, offsets_in
from calmotion.simulation.inputs.time_grid import TimeGrid, make_grid

TIMES = np.arange(49) / 24.0


def window(joined, continues, pre=4):
    return TimeGrid(TIMES, 5, pre, 1 / 120, joined=joined, continues=continues)


@pytest.mark.parametrize(("joined", "continues"), [(True, True), (True, False), (False, True)])
@pytest.mark.parametrize("kept", [True, False])
def test_splines_vanish_with_slope_and_curvature_where_windows_meet(joined, continues, kept):
    grid = window(joined, continues)
    basis = basis_on(grid, uniform_breaks(grid, 1 / 6), kept)
    row = {"start": grid.pre_steps, "end": -1}
    parts = [part.toarray() for part in (basis.values, basis.rates, basis.accelerations)]
    meets = {"start": joined, "end": continues}
    for end in ("start", "end"):
        largest = [np.abs(part[row[end]]).max() for part in parts]
        if meets[end]:
            assert max(largest) < 1e-9
        elif kept:
            assert largest[0] < 1e-12 and largest[1] < 1e-9
        else:
            assert largest[0] == pytest.approx(1.0)
    if joined:
        assert np.abs(parts[0][: grid.pre_steps]).max() < 1e-12
    assert basis.count == basis.support.shape[0] and np.linalg.matrix_rank(parts[0]) == basis.count


def test_frames_hold_offsets_of_successive_windows_exactly():
    whole = make_grid(np.arange(97) / 24.0, 1 / 120, 0.1)
    random, offsets = np.random.default_rng(2), np.zeros((97, 1))
    exact = np.zeros(len(whole.times))
    for first, joined, continues in ((0, False, True), (36, True, False)):
        times = whole.frame_times[: 61 if joined else 60]
        grid = TimeGrid(times, whole.substeps, whole.pre_steps, whole.h, joined=joined, continues=continues)
        basis = basis_on(grid, uniform_breaks(grid, 1 / 8), False)
        x = random.normal(size=basis.count)
        offsets[first : first + len(times), 0] += basis.at_frames @ x
        if not joined:
            exact[: len(grid.times)] += basis.values @ x
        else:
            start = whole.pre_steps + first * whole.substeps
            exact[start:] += (basis.values @ x)[grid.pre_steps :]
    found = offset_curves(offsets, whole)
    np.testing.assert_allclose(found.angles[whole.judged, 0], exact[whole.judged], atol=1e-11)
    rates = np.gradient(found.angles[whole.judged, 0], whole.h)[2:-2]
    np.testing.assert_allclose(found.rates[whole.judged, 0][2:-2], rates, atol=2e-2 * np.abs(rates).max())


@pytest.mark.parametrize("pre_roll", [0.0, 0.1])
def test_offsets_sampled_in_a_part_are_those_of_the_whole_to_the_last_bit(pre_roll):
    whole = make_grid(np.arange(97) / 24.0, 1 / 120, pre_roll)
    offsets = np.random.default_rng(6).normal(size=(97, 2))
    for first, joined in ((0, False), (36, True)):
        pre = 4 if joined else whole.pre_steps
        grid = TimeGrid(whole.frame_times[:25], whole.substeps, pre, whole.h, joined=joined, continues=True)
        start = whole.pre_steps + first * whole.substeps - pre
        part = Part(SimpleNamespace(grid=grid), slice(start, start + len(grid.times)), first)
        for given in (offsets, 0.0 * offsets):
            found, expected = offsets_in(part, given, whole), part.curves_of(offset_curves(given, whole))
            for one, other in zip(found.derivatives, expected.derivatives, strict=True):
                assert np.array_equal(one, other) and len(one) == len(grid.times)


def test_the_regulariser_counts_the_offsets_that_are_there():
    grid = window(True, True)
    basis = basis_on(grid, uniform_breaks(grid, 1 / 6), False)
    random = np.random.default_rng(4)
    there = basis.values @ random.normal(size=(basis.count, 2)), random.normal(size=(len(grid.times), 2))
    space = OffsetSpace(
        basis, np.array([0, 1]), np.eye(2), 1e-2, 1e-1, BaseOffsets(there[0], there[1], grid.h)
    )  # fmt: skip
    x, d = random.normal(size=space.size), random.normal(size=space.size)
    eps = 1e-6
    slope = (space.penalty_value(x + eps * d) - space.penalty_value(x - eps * d)) / (2.0 * eps)
    assert slope == pytest.approx(space.penalty_gradient(x) @ d, rel=1e-7)
    np.testing.assert_allclose(space.penalty_gradient(x + d) - space.penalty_gradient(x), space.penalty_product(d))
    # the same offsets as unknowns have the same penalty on closeness
    plain = OffsetSpace(basis, np.array([0, 1]), np.eye(2), 0.0, 1e-1)
    y = random.normal(size=plain.size)
    values = plain.offsets(y)[0]
    based = OffsetSpace(basis, np.array([0, 1]), np.eye(2), 0.0, 1e-1, BaseOffsets(values, 0.0 * values, grid.h))
    assert based.penalty_value(np.zeros(plain.size)) == pytest.approx(plain.penalty_value(y), rel=1e-9)
    np.testing.assert_allclose(based.pull, plain.penalty_product(y), rtol=1e-9, atol=1e-15)
