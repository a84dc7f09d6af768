"""Splines are taken as authored: uneven tangents, corners and steps."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.curves import curve_of
from calmotion.usd.reading import read_shot
from calmotion.usd.reading.motors.tracks import STEP
from calmotion.usd.writing import write_result
from performing import result_with
from pxr import Ts, Usd
from small_shots import ELBOW, TARGET_POSITION, write_arm

RATE = 24.0
FINE = np.linspace(0.0, 1.0, 1201)


def knot(time, value, interpolation=Ts.InterpCurve, slope=0.0, widths=(1.0, 1.0)):
    made = Ts.Knot(typeName="float", time=time, value=value, nextInterp=interpolation)
    for side, width in (("Pre", widths[0]), ("Post", widths[1])):
        getattr(made, f"Set{side}TanWidth")(width)
        getattr(made, f"Set{side}TanSlope")(slope)
    return made


SPLINES = {
    "uneven tangents": [knot(0, 0), knot(9, 40, slope=2.0, widths=(6.0, 1.0)), knot(24, -10, widths=(9.0, 1.0))],
    "corners": [knot(0, 0, Ts.InterpLinear), knot(6, 30, Ts.InterpLinear), knot(15, -20, Ts.InterpLinear), knot(24, 5)],
    "a step": [knot(0, 0, Ts.InterpLinear), knot(8, 10, Ts.InterpHeld), knot(16, 25), knot(24, 25)],
}


def animated(name):
    def edit(stage):
        attribute = stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION)
        attribute.Clear()
        spline = Ts.Spline("float")
        for one in SPLINES[name]:
            spline.SetKnot(one)
        attribute.SetSpline(spline)

    return edit


def read(tmp_path, name):
    shot = write_arm(tmp_path / "arm.usda", animated(name))
    stage = Usd.Stage.Open(str(shot))
    spline = stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION).GetSpline()
    return shot, read_shot(str(shot)), spline


def meant(spline, times):
    return np.radians([spline.Eval(RATE * t) for t in times])


@pytest.mark.parametrize("name", ["uneven tangents", "corners"])
def test_the_track_is_the_spline_between_the_frames_too(tmp_path, name):
    _, (_, animation, _), spline = read(tmp_path, name)
    found = curve_of(animation.tracks[1], 1.0, False)(FINE, 0)
    assert np.abs(found - meant(spline, FINE)).max() < 1e-6


def test_corners_are_kept_and_reported(tmp_path):
    _, (character, animation, _), _ = read(tmp_path, "corners")
    assert np.allclose(animation.tracks[1].corners, [6 / RATE, 15 / RATE])
    note = next(note for note in character.notes if "corners" in note)
    assert ELBOW in note and "found 2, the sharpest at time code 6" in note
    _, (character, animation, _), _ = read(tmp_path, "uneven tangents")
    assert not len(animation.tracks[1].corners) and not any("corners" in note for note in character.notes)


def test_a_step_of_a_curve_becomes_a_ramp_of_10_ms_and_is_reported(tmp_path):
    _, (character, animation, _), spline = read(tmp_path, "a step")
    found = curve_of(animation.tracks[1], 1.0, False)(FINE, 0)
    step = 16 / RATE
    away = (FINE < step - STEP - 1e-9) | (FINE >= step)
    assert np.abs(found - meant(spline, FINE))[away].max() < 1e-6
    inside = (FINE > step - STEP) & (FINE < step)
    assert np.all(np.diff(found[inside]) > 0.0) and inside.any()
    note = next(note for note in character.notes if "jumps" in note)
    assert ELBOW in note and "time code 16: from 10 to 25" in note


@pytest.mark.parametrize("name", ["corners", "a step"])
def test_what_had_corners_is_written_as_a_spline_and_keeps_them(tmp_path, name):
    _, (character, animation, provenance), _ = read(tmp_path, name)
    result = result_with(character, animation, {0: 0.1, 1: 0.1})
    _, root = write_result(character, animation, provenance, result, str(tmp_path / "calm.usda"))
    stage = Usd.Stage.Open(root)
    assert stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION).HasSpline()
    _, again, _ = read_shot(root)
    assert np.allclose(again.current[1].corners, animation.tracks[1].corners, atol=1e-6)
    bump = curve_of(dataclasses.replace(animation.tracks[1]), 1.0, False)(FINE, 0)
    found = curve_of(again.current[1], 1.0, False)(FINE, 0)
    assert np.abs(found - bump - 0.1 * np.sin(np.pi * FINE) ** 2).max() < 1e-3
    assert again.current[0].times[1] == pytest.approx(1 / RATE), "the others are samples at the frames"
