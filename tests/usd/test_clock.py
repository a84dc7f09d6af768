"""Time codes and seconds."""

import numpy as np
import pytest
from calmotion.usd.clock import Clock, clock_of
from pxr import Usd


def stage_with(**values: float) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    for name, value in values.items():
        setattr(stage.GetRootLayer(), name, value)
    return stage


def test_frames_start_at_zero_seconds_and_come_back_as_whole_codes():
    clock = Clock(start=101, end=149, time_codes_per_second=24, frames_per_second=24)
    times = clock.frame_times()
    assert len(times) == 49 and times[0] == 0 and times[-1] == pytest.approx(2.0)
    assert np.array_equal(clock.time_codes(times), np.arange(101.0, 150.0))
    assert clock.seconds(125) == pytest.approx(1.0)


def test_frames_need_not_be_time_codes():
    clock = clock_of(stage_with(timeCodesPerSecond=1000, framesPerSecond=25, startTimeCode=0, endTimeCode=1000), [])
    assert len(clock.frame_times()) == 26
    assert clock.time_codes(clock.frame_times())[1] == 40.0


def test_without_frames_per_second_a_frame_is_a_time_code():
    clock = clock_of(stage_with(timeCodesPerSecond=100, startTimeCode=0, endTimeCode=100), [])
    assert clock.frames_per_second == 100.0


def test_a_range_that_is_not_authored_is_that_of_the_samples():
    clock = clock_of(stage_with(timeCodesPerSecond=24), np.array([7.0, 3.0, 31.0]))
    assert (clock.start, clock.end) == (3.0, 31.0)


def test_time_codes_of_whole_seconds_are_no_frames():
    clock = clock_of(stage_with(timeCodesPerSecond=1, startTimeCode=0, endTimeCode=2), [])
    assert clock.frames_per_second == 24.0 and len(clock.frame_times()) == 49
