"""Recordings in other units than those of the shot."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model.run import RunSettings
from calmotion.recordings import MARKER
from calmotion_plugins.calibration.identification.calibrate import CalibrationSettings, calibrate_shot
from calmotion_plugins.calibration.identification.recordings.plausible import refuse_long, refuse_unlike
from calmotion_plugins.calibration.identification.robots import robot_with
from calmotion_plugins.calibration.identification.signals import signals_of

OPTIONS = RunSettings(step=1 / 240, integrator="generalized-alpha")


def changed(recording, times=1.0, values=1.0, offset=0.0):
    channels = [
        dataclasses.replace(
            channel, times=times * channel.times,
            values=values * channel.values + offset if channel.kind == MARKER else channel.values,
        )
        for channel in recording.channels
    ]  # fmt: skip
    return dataclasses.replace(recording, channels=tuple(channels))


def test_times_in_milliseconds_are_refused_before_the_shot_is_simulated(recorded_shot, recordings):
    length = float(recorded_shot.animation.frame_times[-1])
    refuse_long(recordings, length)
    wrong = [changed(recording, times=1000.0) for recording in recordings]
    with pytest.raises(ShotError, match="times in seconds"):
        calibrate_shot(recorded_shot, wrong, CalibrationSettings(), OPTIONS)


@pytest.fixture(scope="module")
def signals(recorded_shot):
    return signals_of(robot_with(recorded_shot, {}), OPTIONS)


def resting(recording):
    channels = (dataclasses.replace(c, values=0.01 * (c.values - np.nanmean(c.values, axis=0)))
                for c in recording.channels if c.kind != MARKER)  # fmt: skip
    return dataclasses.replace(recording, channels=tuple(channels))


@pytest.mark.parametrize(
    ("wrong", "match"),
    [
        (lambda recording: changed(recording, values=1000.0), "in metres and in the world"),
        (lambda recording: changed(recording, offset=np.array([0.0, 100.0, np.nan])), "in metres and in the world"),
        (resting, "nothing moves"),
    ],
    ids=["millimetres", "another frame", "rest"],
)
def test_recordings_that_cannot_be_of_the_shot_are_refused(recorded_shot, recordings, signals, wrong, match):
    refuse_unlike(recorded_shot.character, recordings, signals)
    with pytest.raises(ShotError, match=match):
        refuse_unlike(recorded_shot.character, [wrong(recording) for recording in recordings], signals)
