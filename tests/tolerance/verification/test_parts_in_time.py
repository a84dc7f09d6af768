"""Parts of a long shot that are simulated independently, against one simulation of it."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.support.worker_processes import Fault
from calmotion.tolerance.simulation import simulate_to_tolerance
from calmotion.tolerance.verification.parts_in_time import (
    Elsewhere,
    TimePart,
    in_parts,
    joined_positions,
    parts_in_time,
)
from calmotion.tolerance.verification.verify import verify
from long_moves import animation_of, long_moves


def quiet(fraction, message):
    pass


def here(function, work):
    """The calls in this process, the last one first."""
    for index in reversed(range(len(work))):
        yield index, function(*work[index])


def test_parts_cover_the_shot_and_begin_in_a_calm_instant_before_what_is_kept():
    animation = long_moves(40.0)
    parts = parts_in_time(animation, 10.0, 3.0)
    assert [(part.first, part.last) for part in parts] == [(0, 240), (240, 480), (480, 720), (720, 960)]
    assert parts[0].begin == 0
    values = np.stack([track.values for track in animation.current], axis=1)
    speeds = np.abs(np.gradient(values, animation.frame_times[1], axis=0)).sum(axis=1)
    for part in parts[1:]:
        assert 3.0 <= (part.first - part.begin) / 24.0 <= 5.0
        assert speeds[part.begin] < 0.1 * speeds.max()
    assert len(parts_in_time(animation, 25.0, 3.0)) == 1


def test_positions_are_those_of_the_part_that_keeps_them_and_gaps_are_told():
    parts = [TimePart(0, 0, 48), TimePart(10, 48, 60)]
    one, two = np.zeros((49, 1, 3)), np.zeros((51, 1, 3))
    two[:, 0, 1] = 1.0 + np.arange(51)
    two[30, 0, 1] = 70.0  # frame 40, within the second before frame 48
    positions, gap = joined_positions(parts, [one, two], 1.0 / 24.0)
    assert positions.shape == (61, 1, 3) and gap == 70.0
    np.testing.assert_array_equal(positions[:48], 0.0)
    np.testing.assert_array_equal(positions[48:, 0, 1], 1.0 + np.arange(38, 51))


def test_a_long_shot_that_is_verified_in_parts_has_the_error_of_the_whole(arm, bodies):
    animation, options = long_moves(26.0), RunSettings(tolerance=2e-3)
    shot = compile_shot(arm, animation, bodies)
    result = simulate_to_tolerance(shot, options, quiet)
    whole = verify(shot, None, result, options, quiet)
    parts = verify(shot, None, result, options, quiet, Elsewhere(here, 10.0))
    assert whole.parts == 1 and whole.gap_m == 0.0
    assert parts.parts == 2 and parts.step_s == whole.step_s
    assert 0.0 < parts.gap_m < 0.1 * whole.error_m
    assert parts.error_m == pytest.approx(whole.error_m, abs=2.0 * parts.gap_m)


def test_a_part_that_is_refused_or_lost_is_an_error_of_the_shot(arm, bodies):
    times = np.arange(49) / 24.0
    shot = compile_shot(arm, animation_of(times, [np.zeros(49), np.zeros(49)]), bodies)
    parts = [TimePart(0, 0, 24), TimePart(0, 24, 48)]
    assert in_parts(shot, parts, here, lambda part, more: len(part.animation.frame_times) + more, 1) == [26, 50]
    for answer, told in ((ShotError("no equilibrium"), "no equilibrium"), (Fault("its worker is gone"), "is gone")):
        with pytest.raises(ShotError, match=told):
            in_parts(shot, parts, lambda function, work, one=answer: [(0, one)], len)
