"""Shots that are composed: the animation is read as USD composes it, wherever it lies."""

import numpy as np
import pytest
from calmotion.usd.reading import read_shot
from pxr import Sdf, Ts, Usd, UsdUtils
from small_shots import ELBOW, FRAMES, RATE, TARGET_POSITION, angles, write_arm

ARM = "/Arm"


def bare_stage(path, first=0, last=FRAMES):
    """A stage with the clock of the small shot and nothing else."""
    stage = Usd.Stage.CreateNew(str(path))
    stage.SetTimeCodesPerSecond(RATE)
    stage.SetFramesPerSecond(RATE)
    stage.SetStartTimeCode(first)
    stage.SetEndTimeCode(last)
    return stage


def with_units_of(stage, source):
    for name in ("metersPerUnit", "kilogramsPerUnit", "upAxis"):
        value = source.GetMetadata(name)
        if value is not None:
            stage.SetMetadata(name, value)


def composed(tmp_path, add, first=0, last=FRAMES):
    """The small shot under a new root layer; `add` composes it and may change it."""
    inner = write_arm(tmp_path / "arm.usda")
    stage = bare_stage(tmp_path / "shot.usda", first, last)
    with_units_of(stage, Usd.Stage.Open(str(inner)))
    add(stage, str(inner))
    stage.GetRootLayer().Save()
    return read_shot(str(tmp_path / "shot.usda"))


def elbow(animation, character):
    index = next(k for k, motor in enumerate(character.motors) if motor.path.endswith(ELBOW.rsplit("/", 1)[1]))
    return animation.tracks[index]


def reference(stage, inner, offset=None):
    prim = stage.DefinePrim(ARM)
    prim.GetReferences().AddReference(inner, ARM, offset or Sdf.LayerOffset())
    stage.SetDefaultPrim(prim)


def payload(stage, inner):
    prim = stage.DefinePrim(ARM)
    prim.GetPayloads().AddPayload(inner, ARM)
    stage.SetDefaultPrim(prim)


def variant(stage, inner):
    prim = stage.DefinePrim(ARM)
    stage.SetDefaultPrim(prim)
    sets = prim.GetVariantSets().AddVariantSet("performance")
    for name in ("none", "dance"):
        sets.AddVariant(name)
    sets.SetVariantSelection("dance")
    with sets.GetVariantEditContext():
        prim.GetReferences().AddReference(inner, ARM)


@pytest.mark.parametrize("compose", [reference, payload, variant])
def test_a_character_behind_an_arc_is_the_character(tmp_path, compose):
    character, animation, _ = composed(tmp_path, compose)
    plain, same, _ = read_shot(str(tmp_path / "arm.usda"))
    assert [body.path for body in character.bodies] == [body.path for body in plain.bodies]
    for one, other in zip(animation.tracks, same.tracks, strict=True):
        assert np.array_equal(one.times, other.times) and np.array_equal(one.values, other.values)


def test_an_arc_s_offset_and_scale_are_in_the_times(tmp_path):
    def half_speed(stage, inner):
        reference(stage, inner, Sdf.LayerOffset(10.0, 2.0))

    character, animation, _ = composed(tmp_path, half_speed, 10, 10 + 2 * FRAMES)
    track = elbow(animation, character)
    assert len(animation.frame_times) == 2 * FRAMES + 1
    assert np.allclose(track.times, 2.0 * np.arange(FRAMES + 1) / RATE)
    assert np.allclose(track.values, np.deg2rad(angles(np.arange(FRAMES + 1))[1]), atol=1e-6)


def test_value_clips_carry_the_motors(tmp_path):
    def clipped(stage, inner):
        reference(stage, inner)
        clip = Sdf.Layer.CreateNew(str(tmp_path / "clip.usda"))
        spec = Sdf.AttributeSpec(
            Sdf.CreatePrimInLayer(clip, Sdf.Path(ELBOW)), TARGET_POSITION, Sdf.ValueTypeNames.Float
        )
        for frame in range(FRAMES + 1):
            clip.SetTimeSample(spec.path, float(frame), 7.0 * frame)
        clip.Save()
        manifest = Usd.ClipsAPI.GenerateClipManifestFromLayers([clip], Sdf.Path(ARM))
        manifest.Export(str(tmp_path / "manifest.usda"))
        clips = Usd.ClipsAPI(stage.GetPrimAtPath(ARM))
        clips.SetClipAssetPaths([Sdf.AssetPath("clip.usda")])
        clips.SetClipManifestAssetPath(Sdf.AssetPath("manifest.usda"))
        clips.SetClipPrimPath(ARM)
        clips.SetClipActive([(0.0, 0.0)])
        clips.SetClipTimes([(0.0, 0.0), (float(FRAMES), float(FRAMES))])
        # local opinions of the referenced layer are weaker than clips anchored here

    character, animation, _ = composed(tmp_path, clipped)
    track = elbow(animation, character)
    assert np.allclose(track.values, np.deg2rad(7.0 * track.times * RATE), atol=1e-6) and len(track.times) > FRAMES


def test_time_codes_that_are_not_frames(tmp_path):
    """Time codes in hundredths of a second, frames in 24ths."""

    def coded(stage, inner):
        reference(stage, inner, Sdf.LayerOffset(0.0, 100.0 / RATE))
        stage.SetTimeCodesPerSecond(100.0)
        stage.SetEndTimeCode(100.0 * FRAMES / RATE)

    character, animation, _ = composed(tmp_path, coded)
    # a layer with other time codes a second is scaled by USD as well
    times = elbow(animation, character).times
    assert np.allclose(np.diff(animation.frame_times), 1.0 / RATE)
    assert np.allclose(np.diff(times), np.diff(times)[0]) and len(times) == FRAMES + 1


def test_a_repeating_spline_covers_the_whole_shot(tmp_path):
    def looping(stage, inner):
        reference(stage, inner)
        spline = Ts.Spline("float")
        for time, value in ((0.0, 0.0), (3.0, 20.0), (6.0, 0.0)):
            knot = Ts.Knot("float")
            knot.SetTime(time)
            knot.SetValue(value)
            knot.SetNextInterpolation(Ts.InterpCurve)
            spline.SetKnot(knot)
        spline.SetPostExtrapolation(Ts.Extrapolation(Ts.ExtrapLoopRepeat))
        attribute = stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION)
        attribute.SetSpline(spline)

    character, animation, _ = composed(tmp_path, looping)
    track = elbow(animation, character)
    frames = track.times * RATE
    assert track.values[np.isclose(frames, 9.0)] == pytest.approx(np.deg2rad(20.0), abs=1e-6)
    assert track.values[np.isclose(frames, 12.0)] == pytest.approx(0.0, abs=1e-6)


def test_a_flattened_or_packaged_shot_is_the_same(tmp_path):
    character, animation, _ = composed(tmp_path, reference)
    packed = str(tmp_path / "shot.usdz")
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "shot.usda"), packed)
    other, same, _ = read_shot(packed)
    assert [m.path for m in other.motors] == [m.path for m in character.motors]
    for one, again in zip(animation.tracks, same.tracks, strict=True):
        assert np.array_equal(one.values, again.values)
