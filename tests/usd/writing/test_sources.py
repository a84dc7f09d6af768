"""Curves go back to where they came from: transforms of bodies, joints of a skeleton, drives that the shot lacks."""

import dataclasses
import hashlib
import os

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model import Track
from calmotion.model.curves import held_curve
from calmotion.usd.reading import read_shot
from calmotion.usd.writing import WriteOptions, write_result
from performing import performed, result_with, tracks_of, worst_gap
from posed_shots import ANIMATION, ARM, FOREARM, posed, posed_by_pivots, skeletal
from pxr import Sdf, Ts, Usd, UsdGeom, UsdSkel, UsdUtils
from small_shots import ELBOW, FORE, FRAMES, LENGTH, SHOULDER, TARGET_POSITION, UPPER, angles, write_arm

MOTOR = {"shoulder": 0, "elbow": 1}


def written(tmp_path, edit, bumps, **options):
    """The shot, what was written over it, and what is read back from the root layer."""
    shot = write_arm(tmp_path / "arm.usda", edit)
    before = hashlib.sha256(shot.read_bytes()).hexdigest()
    character, animation, provenance = read_shot(str(shot))
    result = result_with(character, animation, bumps)
    layer, root = write_result(
        character, animation, provenance, result, str(tmp_path / "calm.usda"), WriteOptions(**options)
    )
    assert hashlib.sha256(shot.read_bytes()).hexdigest() == before
    return animation, result, layer, root, read_shot(root)


def properties(layer):
    found = []
    Sdf.Layer.FindOrOpen(layer).Traverse("/", lambda path: found.append(str(path)) if path.IsPropertyPath() else None)
    return sorted(found)


@pytest.mark.parametrize("edit", [posed, posed_by_pivots], ids=lambda edit: edit.__name__)
@pytest.mark.parametrize("motor", MOTOR)
def test_bodies_perform_the_new_curves(tmp_path, edit, motor):
    animation, result, layer, root, (character, again, _) = written(tmp_path, edit, {MOTOR[motor]: 0.1})
    for track, meant in zip(again.tracks, animation.tracks, strict=True):
        assert np.abs(track.values - meant.values).max() < 1e-9
    for track, curve in zip(again.current, result.curves, strict=True):
        assert np.abs(track.values - curve.frame_values).max() < 1e-9
    far, turned = worst_gap(root, character, again, tracks_of(animation, result.curves))
    assert far < 1e-8 and turned < 1e-8
    # the elbow moves the forearm alone
    moved = {path.split(".")[0] for path in properties(layer)}
    assert moved == ({FORE} if motor == "elbow" else {UPPER, FORE})


def posed_by_splines(stage):
    """The elbow turns by a spline that rests at each key, where its curvature jumps."""
    posed(stage)
    fore = UsdGeom.Xformable(stage.GetPrimAtPath(FORE))
    fore.ClearXformOpOrder()
    UsdGeom.Xformable(stage.GetPrimAtPath(UPPER)).ClearXformOpOrder()
    UsdGeom.Xformable(stage.GetPrimAtPath(UPPER)).AddTranslateOp().Set((0, 0, 1))
    fore.AddTranslateOp().Set((LENGTH, 0, 1))
    turn, spline = fore.AddRotateYOp(), Ts.Spline("float")
    for k, value in enumerate((0.0, 30.0, -10.0, 20.0, 0.0)):
        knot = Ts.Knot("float")
        knot.SetTime(0.25 * FRAMES * k)
        knot.SetValue(value)
        knot.SetNextInterpolation(Ts.InterpCurve)
        for width in (knot.SetPreTanWidth, knot.SetPostTanWidth):
            width(0.25 * FRAMES / 3.0)
        spline.SetKnot(knot)
    turn.GetAttr().SetSpline(spline)


def test_bodies_that_splines_pose_perform_the_new_curves_between_frames_too(tmp_path):
    shot = write_arm(tmp_path / "arm.usda", posed_by_splines)
    character, animation, provenance = read_shot(str(shot))
    end = float(animation.frame_times[-1])
    fine = np.linspace(0.0, end, 601)
    authored = held_curve(animation.tracks[1], end)
    stage = Usd.Stage.Open(str(shot))
    spline = stage.GetPrimAtPath(FORE).GetAttribute("xformOp:rotateY").GetSpline()
    meant = np.deg2rad([spline.Eval(24.0 * time) for time in fine])
    assert np.abs(authored(fine, 0) - meant).max() < 1e-4
    bump = 0.1 * np.sin(np.pi * fine / end) ** 2
    new = (animation.tracks[0], Track(fine, authored(fine, 0) + bump))
    result = dataclasses.replace(
        result_with(character, animation, {1: 0.1}), performed=performed(character, animation, new)
    )
    layer, root = write_result(character, animation, provenance, result, str(tmp_path / "calm.usda"), WriteOptions())
    again = read_shot(root)[1]
    assert np.abs(held_curve(again.current[1], end)(fine, 0) - new[1].values).max() < 5e-5
    frames = Track(animation.frame_times, held_curve(new[1], end)(animation.frame_times, 0))
    assert np.abs(held_curve(frames, end)(fine, 0) - new[1].values).max() > 5e-4
    assert {path.split(".")[0] for path in properties(layer)} == {FORE}


def test_a_skeleton_performs_the_new_curves_and_keeps_its_other_joints(tmp_path):
    animation, result, layer, root, (_, again, _) = written(tmp_path, skeletal, {1: 0.1})
    assert properties(layer) == [f"{ANIMATION}.rotations"]
    for track, meant in zip(again.tracks, animation.tracks, strict=True):
        assert np.abs(track.values - meant.values).max() == 0.0
    for track, curve in zip(again.current, result.curves, strict=True):
        assert np.abs(track.values - curve.frame_values).max() < 3e-6
    stages = [Usd.Stage.Open(str(path)) for path in (tmp_path / "arm.usda", root)]
    before, after = (UsdSkel.Animation(stage.GetPrimAtPath(ANIMATION)) for stage in stages)
    assert list(after.GetJointsAttr().Get()) == [ARM, FOREARM]
    for frame in range(FRAMES + 1):
        assert after.GetRotationsAttr().Get(frame)[0] == before.GetRotationsAttr().Get(frame)[0]
        assert after.GetTranslationsAttr().Get(frame) == before.GetTranslationsAttr().Get(frame)


def test_a_skeleton_whose_first_frame_changes_counts_angles_from_where_it_was(tmp_path):
    """Bodies that stand as the skeleton does at the first frame stand where it was before we changed it."""

    def edit(stage):
        skeletal(stage)
        for path in (SHOULDER, ELBOW):
            stage.GetPrimAtPath(path).CreateAttribute("calm:motor:skelPose", Sdf.ValueTypeNames.Token).Set("start")

    shot = write_arm(tmp_path / "arm.usda", edit)
    character, animation, provenance = read_shot(str(shot))
    result = result_with(character, animation, {1: 0.1})
    curves = tuple(
        dataclasses.replace(c, frame_values=c.frame_values + 0.05) if c.changed else c for c in result.curves
    )
    result = dataclasses.replace(result, curves=curves)
    _, root = write_result(character, animation, provenance, result, str(tmp_path / "calm.usda"), WriteOptions())
    _, again, _ = read_shot(root)
    assert abs(again.current[1].values[0] - animation.tracks[1].values[0] - 0.05) < 3e-6
    for track, curve in zip(again.current, curves, strict=True):
        assert np.abs(track.values - curve.frame_values).max() < 3e-6


def test_what_a_hinge_cannot_do_stays_in_the_skeleton(tmp_path):
    _, result, _, root, (_, again, _) = written(tmp_path, lambda stage: skeletal(stage, off_axis=4.0), {1: 0.1})
    assert np.abs(again.current[1].values - result.curves[1].frame_values).max() < 3e-6
    # read as somebody else's animation, the written one is off the axis as the shot was
    flat = Usd.Stage.Open(root).Flatten()
    flat.customLayerData = {}
    flat.Export(str(tmp_path / "flat.usda"))
    character, _, _ = read_shot(str(tmp_path / "flat.usda"))
    assert any("4 degrees" in note for note in character.notes)


def test_a_sparse_animation_stays_sparse_unless_a_joint_is_missing(tmp_path):
    _, _, layer, _, _ = written(tmp_path, lambda stage: skeletal(stage, sparse=True), {1: 0.1})
    assert properties(layer) == [f"{ANIMATION}.rotations"]


def test_a_joint_that_the_animation_lacks_is_added_at_rest(tmp_path):
    _, result, layer, root, (_, again, _) = written(tmp_path, lambda stage: skeletal(stage, sparse=True), {0: 0.1})
    stage = Usd.Stage.Open(root)
    animation = UsdSkel.Animation(stage.GetPrimAtPath(ANIMATION))
    assert list(animation.GetJointsAttr().Get()) == [FOREARM, ARM]
    parts = (animation.GetRotationsAttr(), animation.GetTranslationsAttr(), animation.GetScalesAttr())
    assert [len(part.Get(5)) for part in parts] == [2, 2, 2]
    for track, curve in zip(again.current, result.curves, strict=True):
        assert np.abs(track.values - curve.frame_values).max() < 3e-6


def test_denser_samples_of_a_skeleton_follow_the_curve(tmp_path):
    _, _, layer, _, (_, again, _) = written(tmp_path, skeletal, {1: 0.1}, samples_per_second=96.0)
    assert len(Sdf.Layer.FindOrOpen(layer).ListTimeSamplesForPath(f"{ANIMATION}.rotations")) == 4 * FRAMES + 1


@pytest.mark.parametrize(
    ("edit", "options", "found"),
    [
        (skeletal, {"splines": True}, "--splines"),
        (posed, {"splines": True}, "--splines"),
        (posed, {"samples_per_second": 96.0}, "--samples-per-second"),
        (posed, {"bake": "simulated"}, "--bake=simulated"),
    ],
)
def test_what_such_curves_cannot_be_written_as_is_refused(tmp_path, edit, options, found):
    with pytest.raises(ShotError) as caught:
        written(tmp_path, edit, {1: 0.1}, **options)
    assert caught.value.found == found and caught.value.path in (SHOULDER, ELBOW) and caught.value.remedy
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.usda"]


def half_posed(stage):
    """The shoulder by the transforms of its bodies, the elbow by its drive."""
    posed(stage)
    for frame in range(FRAMES + 1):
        stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION).Set(float(angles(frame)[1]), frame)


@pytest.mark.parametrize("options", [{"splines": True}, {"samples_per_second": 96.0}])
@pytest.mark.parametrize("bumps", [{0: 0.1}, {0: 0.1, 1: 0.1}])
def test_options_of_drives_are_for_the_motors_that_have_one(tmp_path, options, bumps):
    _, result, layer, _, (_, again, _) = written(tmp_path, half_posed, bumps, **options)
    assert [track.values.size for track in again.current][0] == FRAMES + 1
    for track, curve in zip(again.current, result.curves, strict=True):
        at_frames = np.interp(np.arange(FRAMES + 1) / 24.0, track.times, track.values)
        assert np.abs(at_frames - curve.frame_values).max() < 1e-6
    curves = Sdf.Layer.FindOrOpen(layer)
    drive = curves.GetAttributeAtPath(f"{ELBOW}.{TARGET_POSITION}")
    assert (drive is not None) == (1 in bumps)
    if drive is not None and "splines" in options:
        assert drive.HasSpline()
    elif drive is not None:
        assert len(drive.GetInfo("timeSamples")) == 4 * FRAMES + 1


def test_a_motor_of_an_actuator_gets_the_drive_that_its_curve_needs(tmp_path):
    def edit(stage):
        prim = stage.GetPrimAtPath(ELBOW)
        prim.GetAttribute(TARGET_POSITION).Clear()
        prim.RemoveAppliedSchema("PhysicsDriveAPI:angular")
        actuator = stage.DefinePrim("/Arm/actuator", "MjcActuator")
        actuator.CreateRelationship("mjc:target").SetTargets([ELBOW])

    _, result, _, _, (_, again, _) = written(tmp_path, edit, {1: 0.1})
    assert np.abs(again.current[1].values - result.curves[1].frame_values).max() < 1e-6


def test_a_motor_that_follows_another_is_not_written_and_follows_when_read_again(tmp_path):
    def edit(stage):
        stage.GetPrimAtPath(ELBOW).CreateRelationship("newton:mimicJoint").SetTargets([SHOULDER])

    shot = write_arm(tmp_path / "arm.usda", edit)
    character, animation, provenance = read_shot(str(shot))
    result = result_with(character, animation, {0: 0.1, 1: 0.1})
    layer, root = write_result(character, animation, provenance, result, str(tmp_path / "calm.usda"))
    assert properties(layer) == [f"{SHOULDER}.{TARGET_POSITION}"]
    _, again, _ = read_shot(root)
    assert np.abs(again.current[1].values - again.current[0].values).max() < 1e-9
    assert np.abs(again.current[1].values - result.curves[1].frame_values).max() < 1e-6


@pytest.mark.parametrize("edit", [None, posed, skeletal], ids=["drives", "bodies", "skeleton"])
def test_a_package_is_written_over_like_any_shot(tmp_path, edit):
    loose = write_arm(tmp_path / "arm.usda", edit)
    assert UsdUtils.CreateNewUsdzPackage(str(loose), str(tmp_path / "arm.usdz"))
    loose.unlink()
    shot = tmp_path / "arm.usdz"
    shot.chmod(0o444)
    before = hashlib.sha256(shot.read_bytes()).hexdigest()
    character, animation, provenance = read_shot(str(shot))
    result = result_with(character, animation, {1: 0.1})
    (tmp_path / "out").mkdir()
    layer, root = write_result(character, animation, provenance, result, str(tmp_path / "out" / "calm.usda"))
    assert hashlib.sha256(shot.read_bytes()).hexdigest() == before
    opened = Sdf.Layer.FindOrOpen(root)
    assert [os.path.basename(path) for path in opened.subLayerPaths] == ["calm.usda", "arm.usdz"]
    _, again, _ = read_shot(root)
    for track, curve in zip(again.current, result.curves, strict=True):
        assert np.abs(track.values - curve.frame_values).max() < 1e-5
