"""Recordings in other units than those of the shot."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model.run import RunSettings
from calmotion.recordings import MARKER
from calmotion_plugins.calibration.identification.calibrate import CalibrationSettings, calibrate_shot
from calmotion_plugins.calibration.identification.recordings.plausible import refuse_far, refuse_long, refuse_still
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


def test_markers_in_millimetres_or_in_another_frame_are_refused(recorded_shot, recordings):
    signals = signals_of_shot(recorded_shot)
    refuse_far(recorded_shot.character, recordings, signals)
    for wrong in (dict(values=1000.0), dict(offset=np.array([0.0, 100.0, np.nan]))):
        with pytest.raises(ShotError, match="in metres and in the world"):
            refuse_far(recorded_shot.character, [changed(recording, **wrong) for recording in recordings], signals)


def test_a_robot_that_rests_is_no_recording_of_a_shot_that_moves(recorded_shot, recordings):
    signals = signals_of_shot(recorded_shot)
    refuse_still(recorded_shot.character, recordings, signals)
    still = [
        dataclasses.replace(
            recording,
            channels=tuple(dataclasses.replace(c, values=0.01 * (c.values - np.nanmean(c.values, axis=0)))
                           for c in recording.channels),
        )
        for recording in recordings
    ]  # fmt: skip
    with pytest.raises(ShotError, match="nothing moves"):
        refuse_still(recorded_shot.character, still, signals)


def signals_of_shot(shot):
    from calmotion_plugins.calibration.identification.robots import robot_with

    return signals_of(robot_with(shot, {}), OPTIONS)
