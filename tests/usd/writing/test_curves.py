"""Motor curves as time samples."""

from types import SimpleNamespace

import numpy as np
import pytest
from calmotion.model import Animation, Motor, MotorCurve, Track
from calmotion.model.curves import held_curve, interpolate
from calmotion.usd.clock import Clock
from calmotion.usd.writing.curves import NEAR, author_curves, curve_values, sample_times
from pxr import Sdf

FRAMES = np.arange(13) / 24.0
BASE = Track(FRAMES, 0.1 * FRAMES**2)
ANIMATION = Animation(FRAMES, (BASE,), (BASE,))
CURVE = MotorCurve(0, True, FRAMES, 0.3 * np.sin(9.0 * FRAMES), 0.3)


def authored(path, attribute, linear):
    """A layer with the curve of a motor, and the path of its attribute."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    motor = Motor(0, path, attribute, linear=linear)
    character = SimpleNamespace(motors=[motor], retarget=SimpleNamespace(cyclic=False))
    clock = Clock(start=101, end=113, time_codes_per_second=24, frames_per_second=24)
    author_curves(layer, character, ANIMATION, (CURVE,), None, clock, 0.01)
    return layer, f"{path}.{attribute}"


@pytest.mark.parametrize(("rate", "parts"), [(24.0, 1), (25.0, 2), (96.0, 4), (1.0, 1)])
def test_samples_are_at_least_as_dense_as_requested_and_contain_the_frames(rate, parts):
    times = sample_times(FRAMES, rate)
    assert len(times) == 12 * parts + 1
    assert np.allclose(times[::parts], FRAMES)


def test_between_frames_a_curve_is_what_its_frames_are_read_back_as():
    times = sample_times(FRAMES, 240.0)
    read_back = interpolate(Track(FRAMES, CURVE.frame_values), 0.5)
    assert np.abs(curve_values(ANIMATION, CURVE, times, False) - read_back(times)).max() < 1e-14
    assert curve_values(ANIMATION, CURVE, FRAMES, False) is CURVE.frame_values


def test_what_is_authored_between_frames_is_kept_where_the_frames_alone_would_lose_it():
    """The curvature of the track jumps at 0.1 s, between two frames, and in the rest it is smooth."""
    times = np.linspace(0.0, 0.5, 241)
    kinked = Track(times, 0.1 * times**2 + 20.0 * np.maximum(times - 0.1, 0.0) ** 2)
    smooth = Track(times, np.sin(times))
    assert sample_times(FRAMES, None, [smooth]) is FRAMES
    assert len(sample_times(FRAMES, 48.0, [kinked])) == 25
    found = sample_times(FRAMES, None, [smooth, kinked])
    assert np.isin(FRAMES, found).all() and 20 < len(found) < 120
    whole = held_curve(kinked, 0.5)
    read_back = held_curve(Track(found, whole(found, 0)), 0.5)
    at_frames = held_curve(Track(FRAMES, whole(FRAMES, 0)), 0.5)
    assert np.abs(read_back(times, 0) - kinked.values).max() <= NEAR
    assert np.abs(at_frames(times, 0) - kinked.values).max() > 3e-4


def test_values_are_degrees_at_the_time_codes_of_the_stage():
    layer, path = authored("/arm/elbow", "drive:angular:physics:targetPosition", linear=False)
    assert layer.ListTimeSamplesForPath(path) == list(range(101, 114))
    assert layer.QueryTimeSample(path, 105) == pytest.approx(np.rad2deg(CURVE.frame_values[4]), abs=1e-5)
    assert layer.GetAttributeAtPath(path).typeName == Sdf.ValueTypeNames.Float


def test_values_of_length_motors_are_in_the_stage_s_unit():
    layer, path = authored("/arm/slide", "drive:linear:physics:targetPosition", linear=True)
    assert layer.QueryTimeSample(path, 105) == pytest.approx(100.0 * CURVE.frame_values[4], rel=1e-6)
