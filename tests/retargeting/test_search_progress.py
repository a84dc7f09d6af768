"""How far a search is."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import Track
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.search_progress import SearchProgress, SuccessiveSearches, share_of_pass
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.reduced_bodies import RunMemory
from calmotion.tolerance.simulation import FINDING


def fractions(gains, enough=1e-5):
    done = SearchProgress(enough)
    return np.array([done.fraction(gains[: k + 1]) for k in range(len(gains))])


@pytest.mark.parametrize("ratio", [0.02, 0.1, 0.3, 0.6])
def test_steady_convergence_is_steady_progress(ratio):
    gains = [1e-2]
    while gains[-1] * ratio > 1e-5:
        gains.append(ratio * gains[-1])
    found = np.array([0.1, *fractions(gains)])
    assert np.all(np.diff(found) >= 0.0)
    assert found[-1] > 0.6
    # each iteration takes about the same part
    assert np.diff(found).max() < 2.5 * 0.56 / len(gains)


def test_progress_never_falls_and_stays_below_the_end():
    gains = [1e-2, 5e-2, 1e-3, np.nan, 4e-3, 1e-6, 1e-2]
    found = fractions(gains)
    assert np.all(np.diff(found) >= 0.0) and found[0] > 0.1 and found[-1] <= 0.9


def test_further_knots_take_a_share_of_what_is_left():
    done = SearchProgress(1e-5)
    first = done.fraction([1e-2, 1e-5])
    done.next_pass(2)
    second = done.fraction([1e-2, 1e-5, 1e-4, 1e-5])
    assert first == pytest.approx(0.1 + 0.8 * 0.7) and first < second < 0.9


def test_a_minimisation_with_nothing_to_gain_is_done():
    assert share_of_pass([1e-6], 1e-5) == 1.0
    assert share_of_pass([], 1e-5) == share_of_pass([np.nan, 0.0], 1e-5) == 0.0


def test_further_searches_never_go_back():
    seen = []
    searches = SuccessiveSearches(lambda fraction, message: seen.append(fraction))
    for _ in range(3):
        for fraction in (0.0, 0.5, 0.95):
            searches(fraction, "")
        searches.ended()
    assert np.all(np.diff(seen) > 0.0) and seen[-1] < 1.0


def test_the_progress_of_a_real_search_has_no_large_jump(arm, animation, bodies):
    seen = []
    shot = compile_shot(arm, animation, bodies)
    options = RunSettings(step=1 / 120, tolerance=1e-4)
    optimize_to_tolerance(shot, options, lambda fraction, message: seen.append((fraction, message)))
    found = [fraction for fraction, message in seen if message not in (FINDING, "choosing the time step")]
    assert np.all(np.diff(found) >= 0.0)
    assert np.diff([*found, 1.0]).max() < 0.5, found  # it has two iterations


OPTIONS = RunSettings(step=1 / 240, tolerance=1e-4)


def quiet(fraction, message):
    pass


@pytest.fixture(scope="module")
def left(arm, animation, bodies):
    memory = RunMemory()
    return memory, optimize_shot(compile_shot(arm, animation, bodies), OPTIONS, quiet, memory=memory)


def begun_with(found, animation):
    """An animation whose current curves have the changes that were found."""
    current = [
        Track(animation.frame_times, curve.frame_values) if curve.changed else track
        for curve, track in zip(found.curves, animation.tracks, strict=True)
    ]
    return dataclasses.replace(animation, current=tuple(current))


def products(result):
    return result.search.linearized_sweeps


def test_the_directions_of_the_last_search_save_sweeps(arm, animation, bodies, left):
    memory, found = left
    assert len(memory.search.recycled.p) > 0 and memory.search.sharpened is None
    again = compile_shot(arm, begun_with(found, animation), bodies)
    kept = optimize_shot(again, OPTIONS, quiet, memory=dataclasses.replace(memory))
    plain = optimize_shot(again, OPTIONS, quiet)
    assert products(kept) <= products(plain) < products(found)
    assert kept.objective_after <= 1.02 * plain.objective_after


def test_other_unknowns_take_nothing(left):
    memory, _ = left
    other = dataclasses.replace(memory.search, breaks=memory.search.breaks[:-1])

    class Problem:
        class space:  # noqa: N801
            motors = memory.search.motors

            class basis:  # noqa: N801
                breaks = memory.search.breaks

    search = dataclasses.make_dataclass("Search", ["x", "radius"])(np.zeros(3), np.inf)
    assert other.begun(Problem, search) is search
    assert memory.search.begun(Problem, search) is search, "of another size"
