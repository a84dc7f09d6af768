"""What a search leaves to the next one: taken where the unknowns are the same, and a better begin there."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import Track
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.reduced_bodies import RunMemory

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
