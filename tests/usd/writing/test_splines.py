"""Motor curves as splines: exact between frames, with no more knots than the curve has, repeating in a loop."""

from types import SimpleNamespace

import numpy as np
import pytest
from calmotion.model import Animation, Motor, MotorCurve, Track
from calmotion.model.curves import curve_of
from calmotion.usd.clock import Clock
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.motors.tracks import read_track
from calmotion.usd.units import StageUnits
from calmotion.usd.writing.splines import author_splines, hermite
from pxr import Sdf, Usd
from scipy.interpolate import CubicSpline

FRAMES = np.arange(49) / 24.0
FINE = np.linspace(0.0, 2.0, 997)
CLOCK = Clock(start=101, end=149, time_codes_per_second=24, frames_per_second=24)
KNOTS = FRAMES[[0, 6, 10, 14, 30, 48]]


def offset(cyclic):
    """A cubic spline with knots on a few frames."""
    values = np.array([0.0, 0.03, -0.02, 0.05, 0.01, 0.0])
    return CubicSpline(KNOTS, values, bc_type="periodic" if cyclic else "clamped")


def optimised(base, cyclic=False):
    """A base track and the curve that the offset makes of it."""
    animation = Animation(FRAMES, (base,), (base,))
    values = curve_of(base, 2.0, cyclic)(FRAMES, 0) + offset(cyclic)(FRAMES)
    return animation, MotorCurve(0, True, KNOTS, values, 0.05)


def sparse():
    times = FRAMES[[0, 12, 20, 36, 48]]
    return Track(times, np.array([0.1, 0.9, 0.4, 1.2, 0.1]))


@pytest.mark.parametrize("cyclic", [False, True])
@pytest.mark.parametrize(
    "base", [sparse(), Track(FRAMES, np.sin(np.pi * FRAMES)), Track(np.array([0.0]), np.array([0.2]))]
)
def test_the_spline_is_the_solver_s_curve_between_frames_too(base, cyclic):
    animation, curve = optimised(base, cyclic)
    motor = Motor(0, "/arm/elbow", "drive:angular:physics:targetPosition")
    character = SimpleNamespace(motors=[motor], retarget=SimpleNamespace(cyclic=cyclic))
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_splines(layer, character, animation, (curve,), CLOCK, 1.0)
    stage = Usd.Stage.Open(layer)
    attribute = stage.GetAttributeAtPath(f"{motor.path}.{motor.attribute}")
    assert attribute.HasSpline() and not attribute.GetTimeSamples()
    meant = curve_of(base, 2.0, cyclic)(FINE, 0) + offset(cyclic)(FINE)
    found = np.deg2rad([attribute.Get(float(code)) for code in CLOCK.time_codes(FINE)])
    assert np.abs(found - meant).max() < 1e-6
    knots = attribute.GetSpline().GetKnots()
    inner = base.times[(base.times > 0.0) & (base.times < 2.0)]
    assert len(knots) == len(np.union1d(np.round(inner, 9), np.round(KNOTS, 9)))
    later = np.deg2rad(attribute.Get(float(CLOCK.time_codes(2.4))))
    if cyclic:
        assert later == pytest.approx(np.interp(0.4, FINE, meant), abs=1e-4), "it repeats itself"
    else:
        assert later == pytest.approx(meant[-1], abs=1e-6), "it is held"


@pytest.mark.parametrize("cyclic", [False, True])
def test_what_was_written_is_read_back_as_the_same_curve(cyclic):
    animation, curve = optimised(sparse(), cyclic)
    motor = Motor(0, "/arm/slide", "drive:linear:physics:targetPosition", linear=True)
    character = SimpleNamespace(motors=[motor], retarget=SimpleNamespace(cyclic=cyclic))
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_splines(layer, character, animation, (curve,), CLOCK, 0.01)
    stage = Usd.Stage.Open(layer)
    attribute = stage.GetAttributeAtPath(f"{motor.path}.{motor.attribute}")
    reading = Reading(stage, StageUnits(1.0, 1.0), 101.0)
    read = read_track(attribute, CLOCK, reading, 0.01)
    meant = curve_of(sparse(), 2.0, cyclic)(FINE, 0) + offset(cyclic)(FINE)
    assert np.abs(curve_of(read, 2.0, cyclic)(FINE, 0) - meant).max() < 1e-6
    assert len(reading.notes) == 1 and "knots" in reading.notes[0] and not len(read.corners)


def test_a_curve_that_did_not_change_has_the_animation_s_knots_alone():
    base = sparse()
    values = curve_of(base, 2.0, False)(FRAMES, 0)
    times, found, before, after = hermite(
        Animation(FRAMES, (base,), (base,)), MotorCurve(0, False, KNOTS, values, 0.0), False
    )
    assert np.array_equal(times, base.times) and np.allclose(found, base.values)
    assert np.allclose(after, curve_of(base, 2.0, False)(times, 1)) and np.array_equal(before, after)
