"""Tracks: seconds and radians, splines, held ends, broken samples."""

import numpy as np
import pytest
from calmotion.usd.reading import read_shot
from pxr import Ts
from small_shots import ELBOW, FRAMES, RATE, TARGET_POSITION, angles, write_arm


def read(tmp_path, edit=None):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))


def drive(stage, path: str = ELBOW):
    return stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION)


def test_samples_become_seconds_and_radians(tmp_path):
    _, animation, _ = read(tmp_path)
    frames = np.arange(FRAMES + 1)
    assert np.allclose(animation.frame_times, frames / RATE)
    for track, column in zip(animation.tracks, angles(frames), strict=True):
        assert np.allclose(track.times, frames / RATE)
        assert np.allclose(track.values, np.deg2rad(column), atol=1e-6)
    assert animation.current is animation.tracks


def test_samples_outside_the_shot_and_between_frames_are_kept(tmp_path):
    def edit(stage):
        drive(stage).Set(1.0, -3.0)
        drive(stage).Set(2.0, 0.5)
        drive(stage).Set(3.0, 30.0)

    track = read(tmp_path, edit)[1].tracks[1]
    assert track.times[0] == pytest.approx(-3 / RATE) and track.times[-1] == pytest.approx(30 / RATE)
    assert track.values[2] == pytest.approx(np.deg2rad(2.0), abs=1e-7)
    assert np.all(np.diff(track.times) > 0)


def test_time_codes_need_not_start_at_zero(tmp_path):
    def edit(stage):
        stage.SetStartTimeCode(6)
        stage.SetEndTimeCode(18)

    _, animation, provenance = read(tmp_path, edit)
    assert len(animation.frame_times) == 13 and animation.frame_times[0] == 0.0
    assert animation.tracks[0].times[0] == pytest.approx(-6 / RATE)
    assert (provenance.start_time_code, provenance.end_time_code) == (6.0, 18.0)


def test_values_are_held_where_samples_do_not_span_the_shot(tmp_path):
    def edit(stage):
        for frame in [*range(6), *range(20, FRAMES + 1)]:
            drive(stage).ClearAtTime(frame)

    character, animation, _ = read(tmp_path, edit)
    track = animation.tracks[1]
    assert np.allclose(track.times, np.arange(FRAMES + 1) / RATE)
    assert np.all(track.values[:6] == track.values[6]) and np.all(track.values[20:] == track.values[19])
    assert any("held" in note for note in character.notes)


def test_a_spline_is_evaluated_at_the_frames(tmp_path):
    def edit(stage):
        attribute = drive(stage)
        attribute.Clear()
        spline = Ts.Spline("float")
        for time, value in ((0.0, 0.0), (24.0, 48.0)):
            spline.SetKnot(Ts.Knot(typeName="float", time=time, value=value, nextInterp=Ts.InterpLinear))
        attribute.SetSpline(spline)

    character, animation, _ = read(tmp_path, edit)
    assert np.allclose(animation.tracks[1].values, np.deg2rad(2.0 * np.arange(FRAMES + 1)), atol=1e-6)
    assert any("spline" in note for note in character.notes)


def test_a_layer_offset_is_in_the_times(tmp_path):
    write_arm(tmp_path / "robot.usda")
    shot = tmp_path / "shot.usda"
    shot.write_text(
        "#usda 1.0\n(\n startTimeCode = 10\n endTimeCode = 34\n timeCodesPerSecond = 24\n metersPerUnit = 1\n"
        " subLayers = [@./robot.usda@ (offset = 10)]\n)\n"
    )
    track = read_shot(str(shot))[1].tracks[0]
    assert track.times[0] == pytest.approx(0.0) and track.times[-1] == pytest.approx(1.0)


def test_samples_between_the_frames_give_a_note(tmp_path):
    character, animation, _ = read(tmp_path, lambda stage: stage.SetFramesPerSecond(12.0))
    assert len(animation.frame_times) == 13
    assert any("more samples" in note for note in character.notes)
    assert not any("more samples" in note for note in read(tmp_path)[0].notes)


@pytest.mark.parametrize(
    ("keys", "noted"),
    [
        ({0: 0.0, 4: 70.0, 8: 0.0, 24: 1.0}, True),
        ({0: 0.0, 24: 40.0}, False),
        ({0: 0.0, 4: 70.0, 8: 0.0, 24: 0.0}, False),
    ],
)
def test_a_smooth_curve_that_swings_far_beyond_sparse_samples_gives_a_note(tmp_path, keys, noted):
    """And not where equal samples are a hold, in which it stands still."""

    def edit(stage):
        drive(stage).Clear()
        for code, value in keys.items():
            drive(stage).Set(value, code)

    character, _, _ = read(tmp_path, edit)
    notes = [note for note in character.notes if "smooth curve" in note]
    assert len(notes) == noted
    if noted:
        assert notes[0].startswith(f"{ELBOW}.{TARGET_POSITION}: between its samples at time codes 8 and 24 (0 and 1)")
