"""Motors that are animated by a skeleton."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from posed_shots import ANIMATION, ARM, SKELETON, skeletal
from pxr import Sdf, UsdGeom, UsdSkel
from small_shots import ELBOW, FRAMES, SHOULDER, Scale, angles, write_arm

FRAME = np.arange(FRAMES + 1)


def read(tmp_path, edit, scale=None):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit, scale)))[:2]


@pytest.mark.parametrize("scale", [Scale(), Scale(0.01, 0.001)], ids=["m", "cm"])
def test_angles_follow_from_a_skeleton_that_stands_elsewhere(tmp_path, scale):
    character, animation = read(tmp_path, skeletal, scale)
    assert [motor.source for motor in character.motors] == ["skeleton", "skeleton"]
    for track, meant in zip(animation.tracks, angles(FRAME), strict=True):
        # rotations of a skeleton are in single precision
        assert np.abs(track.values - np.radians(meant)).max() < 3e-6
    assert not any("off the axes" in note for note in character.notes)


def test_a_joint_that_the_animation_leaves_out_rests(tmp_path):
    _, animation = read(tmp_path, lambda stage: skeletal(stage, sparse=True))
    assert np.abs(animation.tracks[0].values).max() < 3e-6
    assert np.abs(animation.tracks[1].values - np.radians(angles(FRAME)[1])).max() < 3e-6


def test_what_a_hinge_cannot_do_is_reported(tmp_path):
    character, _ = read(tmp_path, lambda stage: skeletal(stage, off_axis=4.0))
    note = next(note for note in character.notes if "off the axes" in note)
    assert ELBOW in note and "4 degrees" in note


def test_what_moves_the_skeleton_as_a_whole_is_told(tmp_path):
    def edit(stage):
        skeletal(stage)
        place = UsdGeom.Xformable(stage.GetPrimAtPath("/Arm/skel")).GetOrderedXformOps()[0]
        for frame in (0, FRAMES):
            place.Set((0.1 * frame, 3, 0), frame)

    character, _ = read(tmp_path, edit)
    assert sum(note.startswith("/Arm/skel: it moves the skeleton") for note in character.notes) == 1
    assert not any("moves the skeleton" in note for note in read(tmp_path, skeletal)[0].notes)


def test_a_joint_may_be_named_by_its_last_part(tmp_path):
    def edit(stage):
        skeletal(stage)
        stage.GetPrimAtPath(SHOULDER).GetAttribute("calm:motor:skelJoint").Set("arm")

    _, animation = read(tmp_path, edit)
    assert np.abs(animation.tracks[0].values - np.radians(angles(FRAME)[0])).max() < 3e-6


def test_motors_of_one_joint_must_form_a_chain(tmp_path):
    def edit(stage):
        skeletal(stage)
        # the shoulder carries the elbow: these do. A third motor on the base does not.
        stage.GetPrimAtPath(ELBOW).GetAttribute("calm:motor:skelJoint").Set(ARM)
        Sdf.CopySpec(stage.GetRootLayer(), SHOULDER, stage.GetRootLayer(), "/Arm/joints/other")
        other = stage.GetPrimAtPath("/Arm/joints/other")
        other.GetRelationship("physics:body0").SetTargets(["/Arm/base"])
        other.GetRelationship("physics:body1").SetTargets(["/Arm/fore"])

    with pytest.raises(ShotError, match="must form a chain") as caught:
        read(tmp_path, edit)
    assert "/Arm/joints/other" in caught.value.found


def rotations(stage):
    return UsdSkel.Animation(stage.GetPrimAtPath(ANIMATION)).GetRotationsAttr()


def read_skeletal(tmp_path, change):
    def edit(stage):
        skeletal(stage)
        change(stage)

    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))


def test_a_skeleton_without_an_animation_says_so(tmp_path):
    character, animation, _ = read_skeletal(
        tmp_path, lambda stage: stage.GetPrimAtPath(SKELETON).RemoveProperty("skel:animationSource")
    )
    assert all(np.ptp(track.values) == 0.0 for track in animation.tracks)
    assert any(note.startswith(SKELETON) and "has no animation" in note for note in character.notes)
