"""Recordings: encoders that pass the end of their range."""

import numpy as np
import pytest
from calmotion.recordings import ANGLE, EFFORT, MARKER, Channel, SensorRecording, unit_of
from calmotion.recordings.recording import turned_on

TIMES = np.arange(200) / 100


@pytest.mark.parametrize("motion", [3.0 + 2.0 * TIMES, -3.0 - 9.0 * TIMES, np.pi + 0.1 * np.sin(30 * TIMES)])
@pytest.mark.parametrize("low", [0.0, -np.pi])
def test_an_encoder_turns_on_where_its_range_ends(motion, low):
    wrapped = (motion - low) % (2 * np.pi) + low
    wrapped[50] = np.nan
    channels = [Channel(kind, "/R/j", TIMES, wrapped[:, None].copy()) for kind in (ANGLE, EFFORT)]
    found = turned_on(SensorRecording("take.csv", "0", tuple(channels)))
    known = np.isfinite(wrapped)
    assert found.channels[0].values[known, 0] == pytest.approx((motion - motion[0] + wrapped[0])[known])
    assert np.isnan(found.channels[0].values[50, 0]) and found.channels[1] is channels[1]
    assert len(found.notes) == (np.nanmax(np.abs(np.diff(wrapped))) > np.pi)


def test_angles_within_a_range_and_slides_stay():
    steps = np.where(TIMES > 1.0, 2.5, 0.0)
    recording = SensorRecording("a.csv", "0", (Channel(ANGLE, "/R/j", TIMES, steps[:, None]),))
    assert turned_on(recording) is recording


def test_units_are_those_of_the_joint_where_it_is_known():
    class Slider:
        path, linear = "/R/slide", True

    class Hinge:
        path, linear = "/R/hinge", False

    motors = [Slider(), Hinge()]
    assert [unit_of(ANGLE, motor.path, motors) for motor in motors] == ["m", "rad"]
    assert [unit_of(EFFORT, motor.path, motors) for motor in motors] == ["N", "N m"]
    assert unit_of(ANGLE, "/R/other", motors) == unit_of(ANGLE, "/R/hinge") == "rad or m"
    assert unit_of(MARKER, "/R/hinge", motors) == "m"
