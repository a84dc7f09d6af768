"""Animations whose numbers are those of another unit, and those that are not."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import MotorTracks, Track
from calmotion.usd.reading.doubtful_motions import limit_doubts, motion_doubts
from calmotion.usd.reading.shot import read_shot
from small_shots import ELBOW, SHOULDER, write_arm

TIMES = np.arange(61) / 60.0
SWING = 0.5 * (1.0 - np.cos(2.0 * np.pi * TIMES))  # 0 to 1 and back
FREE = (-np.inf, np.inf)


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return read_shot(str(write_arm(tmp_path_factory.mktemp("arm") / "arm.usda")))[0]


def doubts(arm, values, limits=FREE, speed=np.inf, times=TIMES, linear=False):
    """Of the shoulder; the elbow does nothing."""
    joints = list(arm.joints)
    motors = [dataclasses.replace(motor, linear=linear) for motor in arm.motors]
    joints[motors[0].joint] = dataclasses.replace(joints[motors[0].joint], lower=limits[0], upper=limits[1])
    motors[0] = dataclasses.replace(motors[0], max_velocity=speed)
    character = dataclasses.replace(arm, joints=tuple(joints), motors=tuple(motors))
    return motion_doubts(character, [Track(times, values), Track(times, np.zeros(len(times)))])


@pytest.mark.parametrize(
    ("values", "limits", "speed", "found"),
    [
        (45.8 * SWING, (-3.1, 3.1), 10.0, "goes to 2624 deg, its limit is 177.6 deg"),
        (-120.0 * SWING, (-2.5, 0.1), np.inf, "goes to -6875 deg, its limit is -143.2 deg"),
        (20.0 * SWING, (-0.5, 0.5), np.inf, "its limit is 28.65 deg"),
        (90.0 + 10.0 * SWING, (0.0, 2.0), np.inf, "its limit is 114.6 deg"),
        (360.0 * SWING, (-6.3, 6.3), np.inf, "goes to 2.063e+04 deg"),
        (90.0 * SWING, FREE, 5.0, "a mean speed of 1.031e+04 deg/s, where at most 286.5 deg/s can be"),
        (90.0 * SWING, FREE, np.inf, "where at most 5730 deg/s can be"),
    ],
)
def test_degrees_that_were_taken_for_radians_are_told_with_their_factor(arm, values, limits, speed, found):
    (note,) = doubts(arm, values, limits, speed)
    assert note.startswith(f"{SHOULDER}: ") and found in note
    assert "0.01745 times" in note and "motion.read.angles=deg" in note
    assert doubts(arm, np.radians(values), limits, speed) == ()


@pytest.mark.parametrize(
    ("factor", "name"), [(1000.0, "0.001 times that would be within (millimetres"), (100.0, "0.01 times")]
)
def test_lengths_in_smaller_units_are_told_with_their_factor(arm, factor, name):
    (note,) = doubts(arm, factor * 0.2 * SWING, (0.0, 0.25), linear=True)
    assert name in note and "its limit is 0.25 m" in note and "angles" not in note
    assert doubts(arm, 0.2 * SWING, (0.0, 0.25), linear=True) == ()


@pytest.mark.parametrize(
    ("values", "limits", "speed"),
    [
        (2.0 * SWING, (0.0, 1.6), np.inf),  # somewhat beyond its limit
        (3.0 * SWING, (-0.1, 0.1), np.inf),  # beyond it by less than half a turn
        (20.0 * np.pi * TIMES, FREE, 40.0),  # a wheel
        (20.0 * SWING, FREE, 8.0),  # too fast, by less than ten times
    ],
)
def test_an_animation_that_may_be_meant_is_not_told(arm, values, limits, speed):
    assert doubts(arm, values, limits, speed) == ()


@pytest.mark.parametrize(
    "values",
    [1e6 * SWING, 4096 / np.pi * SWING, 2048.0 + 100.0 * SWING, np.where(TIMES == 0.5, -999.0, SWING)],
    ids=["far", "hundredths of degrees", "ticks of an encoder", "a number for a missing row"],
)
def test_an_animation_that_no_unit_brings_within_its_limits_is_told(arm, values):
    (note,) = doubts(arm, values, (-3.1, 3.1))
    assert "its limit is" in note and "in no usual unit would that be within" in note


@pytest.mark.parametrize(("values", "limits"), [(2.0 * SWING, FREE), (-1.5 * SWING, (-1.6, 0.1)), (3.1 * SWING, FREE)])
def test_radians_that_were_taken_for_degrees_are_told_with_their_factor(arm, values, limits):
    (note,) = doubts(arm, np.radians(values), limits)
    assert note.startswith(f"{SHOULDER}: all angles") and "radians taken for degrees? Samples times 57.3" in note
    assert doubts(arm, values, limits) == ()


@pytest.mark.parametrize(
    ("values", "limits", "speed"),
    [
        (0.3 * SWING, FREE, np.inf),  # an idle robot that hardly moves
        (4.0 * SWING, FREE, np.inf),  # more than half a turn in radians
        (2.0 * SWING, (-0.1, 1.9), np.inf),  # beyond its limit in radians
        (2.0 * SWING, FREE, 3.0),  # beyond its speed
        (2.0 * np.sin(60.0 * TIMES), FREE, np.inf),  # a tremor
    ],
)
def test_small_animations_are_not_told(arm, values, limits, speed):
    assert doubts(arm, np.radians(values), limits, speed) == ()


@pytest.mark.parametrize(
    ("factor", "found"),
    [(1e3, "16.67 s apart; milliseconds"), (1e6, "Scale the times by 1e-06"), (1e9, "motion.read.times=ns")],
)
def test_times_of_a_clock_that_counts_faster_are_told_with_their_factor(arm, factor, found):
    (note,) = doubts(arm, 0.8 * SWING, times=factor * TIMES)
    assert note.startswith(f"{SHOULDER}: the fastest motor moves by ") and found in note


@pytest.mark.parametrize(
    ("values", "times"),
    [
        (0.8 * SWING, 10.0 * TIMES),  # slow
        (0.0 * SWING, 1000.0 * TIMES),  # at rest
        (0.1 * SWING, np.arange(61) / 2.5),  # slow, and sampled 2.5 times a second
        (np.arange(61) % 3, 5.0 * np.arange(61)),  # poses that are 5 s apart
    ],
)
def test_slow_animations_are_not_told(arm, values, times):
    assert doubts(arm, values.astype(float), times=times) == ()


def test_every_reading_tells_it(tmp_path):
    path = str(write_arm(tmp_path / "arm.usda"))
    given = MotorTracks("table.csv", 1e3 * TIMES, {"shoulder": 0.3 * SWING, "elbow": 0.2 * SWING})
    notes = read_shot(path, given=given)[0].notes
    assert any("milliseconds taken for seconds" in note for note in notes)
    notes = read_shot(path, given=MotorTracks("table.csv", TIMES, {"elbow": 90.0 * SWING}))[0].notes
    assert any(note.startswith(ELBOW) and "degrees taken for radians" in note for note in notes)


HALF_TURNS = [(-np.pi, np.pi), (-1.5708, 1.5708), (-2.618, 0.0), (0.0, 3.1416), (-0.7854, 0.7854)]


def with_limits(arm, limits):
    """The arm with these limits [rad], the last pair of all further joints."""
    pairs = [*limits, *[limits[-1]] * len(arm.joints)]
    joints = [dataclasses.replace(j, lower=low, upper=high) for j, (low, high) in zip(arm.joints, pairs, strict=False)]
    return limit_doubts(dataclasses.replace(arm, joints=tuple(joints)))


@pytest.mark.parametrize("low", [-90.0, -180.0, -45.0, 0.0])
@pytest.mark.parametrize("high", [90.0, 150.0, 360.0])
def test_limits_in_degrees_that_were_taken_for_radians_are_told(arm, low, high):
    (note,) = with_limits(arm, [(low, high)])
    assert "degrees taken for radians" in note and f"would be {low:.4g} and {high:.4g} deg" in note


@pytest.mark.parametrize("limits", HALF_TURNS)
def test_limits_in_radians_that_were_taken_for_degrees_are_told(arm, limits):
    (note,) = with_limits(arm, [np.radians(limits)])
    assert "radians taken for degrees" in note and "times 57.3" in note
    assert with_limits(arm, [limits]) == ()


@pytest.mark.parametrize("limits", [(-5.0, 5.0), (-3.0, 2.0), (-1.0, 1.0), (-10.0, 10.0), (-2.5, 2.5)])
def test_narrow_limits_of_few_joints_are_not_told(arm, limits):
    assert with_limits(arm, [np.radians(limits)]) == ()


@pytest.mark.parametrize("limits", [(-12.57, 12.57), (-31.4, 31.4), (-20.0, 20.0), (-np.inf, np.inf), (-np.inf, 1.0)])
def test_limits_of_several_turns_are_not_told(arm, limits):
    assert with_limits(arm, [limits]) == ()
