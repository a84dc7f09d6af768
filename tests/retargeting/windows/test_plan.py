"""The windows of a long shot: they cover it, overlap, and are automatic where it is long."""

import dataclasses

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model.budget import SEARCH_SHARE
from calmotion.model.robust.settings import RobustSettings
from calmotion.model.run import LONG_SHOT, WINDOW, RunSettings
from calmotion.retargeting.windows.plan import (
    EXACT,
    FEWEST_FRAMES,
    least_gain,
    overlap_time,
    plan_windows,
    window_length,
)


@pytest.mark.parametrize("seconds", [3.0, 61.0, 62.5, 75.0, 600.0])
@pytest.mark.parametrize("overlap", [1.0, 7.3, 10.0])
def test_windows_cover_the_shot_once_and_overlap(seconds, overlap):
    times = np.arange(round(24 * seconds) + 1) / 24.0
    windows = plan_windows(times, 20.0, overlap)
    assert windows[0].first == 0 and windows[-1].kept == windows[-1].last == len(times) - 1 and windows[-1].is_last
    for one, two in zip(windows[:-1], windows[1:], strict=True):
        assert one.kept == two.first and one.first < one.kept < one.last <= len(times) - 1
        assert times[one.last] - times[one.kept] >= overlap - 1e-9 or one.last == len(times) - 1
    assert all(window.last - window.first >= min(FEWEST_FRAMES, len(times) - 1) for window in windows)
    assert abs(len(windows) - seconds / 20.0) <= 1.0


def test_the_overlap_is_the_time_in_which_the_slowest_mode_falls_to_a_tenth():
    frequencies, damping = np.array([4.0, 9.0, 50.0]), np.array([0.02, 0.005, 0.03])
    rate = 2.0 * np.pi * 9.0 * 0.005
    assert np.exp(-rate * overlap_time(frequencies, damping, 100.0)) == pytest.approx(0.1)
    assert overlap_time(frequencies, damping, 10.0) == 2.5  # a quarter of a window at most
    assert overlap_time(frequencies, damping, 5.0) == 1.5  # or what suffices
    assert overlap_time(frequencies, damping, 2.0) == 1.0  # but half a window at most
    assert overlap_time(np.array([100.0]), np.array([0.5]), 20.0) == 1.0
    assert overlap_time(np.zeros(0), np.zeros(0), 20.0) == 1.0


def of_length(animation, seconds):
    return dataclasses.replace(animation, frame_times=np.arange(round(24 * seconds) + 1) / 24.0)


def test_long_shots_have_windows_unless_the_user_says_otherwise(arm, animation):
    short, long = of_length(animation, LONG_SHOT), of_length(animation, LONG_SHOT + 1)
    assert window_length(arm, short, RunSettings()) is None and window_length(arm, long, RunSettings()) == WINDOW
    assert window_length(arm, long, RunSettings(window=0.0)) is None
    assert window_length(arm, short, RunSettings(window=7.0)) == 7.0
    assert window_length(arm, short, RunSettings(window=100.0)) is None
    cyclic = dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, cyclic=True))
    assert window_length(cyclic, long, RunSettings()) is None
    assert window_length(arm, long, RunSettings(robust=RobustSettings())) is None
    assert window_length(arm, long, RunSettings(adjoint="continuous")) is None


def test_what_is_found_of_a_long_shot_does_not_depend_on_its_windows(arm, animation):
    short, long = of_length(animation, LONG_SHOT), of_length(animation, LONG_SHOT + 1)
    for window in (None, 7.0):
        assert least_gain(arm, long, RunSettings(window=window)) == EXACT
    one = least_gain(arm, long, RunSettings(window=0.0))  # a second counts in its mean as in a window's
    assert one * (LONG_SHOT + 1) == pytest.approx(EXACT * WINDOW)
    assert least_gain(arm, short, RunSettings(window=7.0)) == EXACT
    assert least_gain(arm, short, RunSettings(window=0.0)) == least_gain(arm, short, RunSettings()) == SEARCH_SHARE
    assert least_gain(arm, long, RunSettings(robust=RobustSettings())) == SEARCH_SHARE  # one search, of many robots


def test_windows_that_cannot_be_are_refused(arm, animation):
    long = of_length(animation, 30.0)
    cyclic = dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, cyclic=True))
    for character, options, problem in (
        (cyclic, RunSettings(window=5.0), "cyclic"),
        (arm, RunSettings(window=5.0, robust=RobustSettings()), "robust"),
        (arm, RunSettings(window=5.0, adjoint="continuous"), "continuous adjoint"),
        (arm, RunSettings(window=0.1), "too short"),
    ):
        with pytest.raises(ShotError, match=problem) as error:
            window_length(character, long, options)
        assert error.value.remedy and error.value.path == "/Arm"
