"""The share of what motors and links do that a calibration leaves unexplained, of each channel."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain
from calmotion.model import Animation, Track
from calmotion.model.motor import DRIVE
from calmotion.recordings import ANGLE, EFFORT, STRAIN, Channel
from calmotion.simulation.compiled_shot import compile_shot
from calmotion_plugins.calibration.identification.calibrate import _share
from calmotion_plugins.calibration.identification.recordings.sensors import Sensor
from calmotion_plugins.calibration.identification.takes import Take

FRAMES = np.arange(49) / 24.0
COMMAND = np.sin(FRAMES) ** 2
TIMES = np.arange(0.0, 2.0, 0.01)
LAG = 0.05 * np.sin(9.0 * TIMES)[:, None]
HELD = (TIMES > 0.8) & (TIMES < 1.2)


def take(model):
    arm = chain(1, driven=(0,))
    arm = replace(arm, motors=(replace(arm.motors[0], model=model, position_gain=50.0),))
    tracks = (Track(FRAMES, COMMAND),)
    return Take(compile_shot(arm, Animation(FRAMES, tracks, tracks), None), (), 0.0)


def share(kind, values, off, model=DRIVE):
    sensor = Sensor(0, Channel(kind, "/C/J0", TIMES, values), 0, np.ones(len(TIMES), bool), HELD, 1e-3)
    return _share(take(model), sensor, TIMES, off)


def test_an_encoder_tells_the_share_of_the_lag_that_is_left_fitted_and_held_out():
    lagging = np.sin(TIMES[:, None]) ** 2 + LAG
    lost = np.where(HELD[:, None], 0.2, 0.05)
    whole = np.sqrt(np.mean((lost * LAG) ** 2) / np.mean(LAG**2))
    assert share(ANGLE, lagging, lost * LAG) == pytest.approx(whole, rel=1e-3)


def test_a_gauge_tells_the_share_of_its_shake_whatever_its_offset():
    shake = LAG - LAG.mean()
    assert share(STRAIN, 3.0 + shake, 0.1 * shake) == pytest.approx(0.1)


def test_other_channels_and_encoders_of_ideal_motors_do_not_tell():
    assert np.isnan(share(EFFORT, LAG, LAG)) and np.isnan(share(ANGLE, LAG, LAG, "prescribed"))
