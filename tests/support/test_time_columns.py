"""Columns of times by their names and their values."""

import numpy as np
import pytest
from calmotion.support import TIME_UNITS, counters, exact_step, exact_times, instants, time_column

SECONDS = np.array([0.0, 0.01, 0.02, 0.03])
JOINTS = {"shoulder_pan": np.zeros(4), "time_belt": np.ones(4), "wrist": np.zeros(4)}


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("t", "s"), ("time", "s"), ("Time", "s"), ("timestamp", "s"), ("TimeStamp", "s"), ("time (s)", "s"),
        ("Time [s]", "s"), ("time_sec", "s"), ("secs", "s"), ("Seconds", "s"), ("elapsed time", "s"), ("sim_time", "s"),
        ("header.stamp", "s"), ("/joint_states/header/stamp", "s"), ("Time(ms)", "ms"), ("time_ms", "ms"),
        ("timestampMs", "ms"), ("milliseconds", "ms"), ("t_us", "us"), ("time [\u00b5s]", "us"), ("timestamp_us", "us"),
        ("timestamp_ns", "ns"), ("timestampNs", "ns"), ("nanoseconds", "ns"), ("rosbagTimestamp (ns)", "ns"),
    ],
)  # fmt: skip
def test_names_of_times_and_their_units(name, unit):
    columns = {"shoulder_pan": np.zeros(4), name: SECONDS / TIME_UNITS[unit], "wrist": np.zeros(4)}
    if name.startswith("/joint_states"):
        columns = {name.replace("/joint_states/", ""): SECONDS, "wrist": np.zeros(4)}
    found = time_column(columns)
    assert found.unit == unit and found.values * TIME_UNITS[unit] == pytest.approx(SECONDS)


@pytest.mark.parametrize(
    ("start", "step", "unit"),
    [
        (0.0, 0.01, "s"), (12.5, 1.0, "s"), (1.7e9, 0.01, "s"), (1.7e12, 10.0, "ms"), (1.7e15, 1e4, "us"),
        (1.7e18, 1e7, "ns"), (0.0, 1e4, "us"), (3e9, 1e7, "ns"), (0.0, 1e6, "ns"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["%time", "stamp", "header.stamp"])
def test_units_of_values_whose_name_has_none(name, start, step, unit):
    assert time_column({name: start + step * np.arange(4), **JOINTS}).unit == unit


@pytest.mark.parametrize(
    "names", [("secs", "nsecs"), ("header.stamp.secs", "header.stamp.nsecs"), ("stamp.sec", "stamp.nanosec")]
)
def test_seconds_and_nanoseconds_are_one_time(names):
    columns = {names[0]: np.array([7.0, 7, 8, 8]), names[1]: np.array([0, 5e8, 0, 5e8]), **JOINTS}
    found = time_column(columns)
    assert found.names == names and found.values == pytest.approx([0.0, 0.5, 1.0, 1.5]) and found.unit == "s"


def test_the_stamp_of_a_header_counts_before_the_time_of_writing():
    columns = {"%time": 1.7e18 + np.array([1.0, 3, 9, 10]), "field.header.stamp": 1.7e18 + 1e7 * np.arange(4), **JOINTS}
    assert time_column(columns).names == ("field.header.stamp",)


def test_joints_are_no_times():
    assert time_column(JOINTS) is None
    assert time_column({"elbow": SECONDS, "clockwise": SECONDS, "ms": SECONDS, "index": SECONDS}) is None


def test_columns_that_number_the_rows():
    columns = {
        "": np.arange(4.0),
        "frame": 3 + np.arange(4.0),
        "index": SECONDS,
        "seq": np.array([1.0, 1, 2, 3]),
        "episode_index": np.full(4, 7.0),
        "task_index": np.arange(4.0),
        **JOINTS,
    }
    assert counters(columns) == ["", "frame", "episode_index"]


@pytest.mark.parametrize(
    "cells",
    [
        ["2024-05-17T23:59:59.500", "2024-05-18T00:00:00.250Z"], ["2024-05-17 12:00:00,5", "2024-05-17 12:00:01,25"],
        ["17.05.2024 09:00:00", "17.05.2024 09:00:00.75"], ["5/17/2024 9:00:59.5", "5/17/2024 9:01:00.25"],
        ["2024/12/31 23:59:59.5", "2025/01/01 00:00:00.25"], ["08:59:59.25", "09:00:00"],
    ],
)  # fmt: skip
def test_dates_and_times_of_a_day_are_seconds(cells):
    assert np.diff(instants(cells)) == pytest.approx([0.75])


@pytest.mark.parametrize("cells", [["17.05.2024 23:59:59", "18.05.2024 00:00:01"], ["12:00:00", "soon"], ["12:00"]])
def test_what_may_be_another_time_is_none(cells):
    assert instants(cells) is None


@pytest.mark.parametrize(
    ("printed", "rate"),
    [
        ("0.0333333", 30), ("0.033333", 30), ("0.0333", 30), ("0.033", 30), ("0.008333", 120), ("0.0083333", 120),
        ("0.0416667", 24), ("0.041708", 24 / 1.001), ("3.33333e-2", 30), (".01", 100), ("0.04", 25), ("0.02", 50),
        ("0.0333667", 30 / 1.001), ("0.012340", 1 / 0.01234),
    ],
)  # fmt: skip
def test_printed_frame_times_are_those_of_whole_rates(printed, rate):
    assert exact_step(printed) == pytest.approx(1.0 / rate, rel=1e-12)


@pytest.mark.parametrize(
    ("rate", "decimals"), [(24, 2), (30, 2), (50, 3), (60, 3), (240, 4), (120, 6), (60 / 1.001, 3), (24 / 1.001, 6)]
)
def test_rounded_times_are_even_again(rate, decimals):
    times = np.arange(200) / rate
    assert exact_times(np.round(times, decimals)) == pytest.approx(times, abs=1e-12)
    uneven = np.sort(times + 0.2 / rate * np.sin(40 * np.arange(200)))
    assert np.array_equal(exact_times(uneven), uneven)
