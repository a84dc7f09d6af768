"""Joints that hold bodies elsewhere than their transforms show them."""

import pytest
import small_shots as shots
from calmotion.usd.reading.shot import read_shot
from pxr import Gf, UsdGeom, UsdPhysics
from small_shots import BASE, ELBOW


def found(tmp_path, edit):
    def edited(stage):
        shots.make_target(stage)
        edit(stage)

    character, *_ = read_shot(str(shots.write_arm(tmp_path / "shot.usda", edited)))
    notes = character.notes
    return [note for note in notes if "do not meet" in note]


def parent(stage):
    return UsdGeom.Xformable(stage.GetPrimAtPath("/Arm"))


def test_frames_that_meet_are_not_mentioned(tmp_path):
    assert found(tmp_path, lambda stage: None) == []


@pytest.mark.parametrize(
    ("edit", "size"),
    [
        (lambda s: parent(s).AddRotateZOp().Set(90), "90 deg"),
        (lambda s: parent(s).AddTranslateOp(opSuffix="away").Set(Gf.Vec3d(3, 4, 0)), "5 m and 0 deg"),
        (lambda s: parent(s).AddScaleOp().Set(Gf.Vec3f(1, -1, 1)), "180 deg"),
    ],
)
def test_a_joint_to_the_world_does_not_move_with_the_transform_above_the_robot(tmp_path, edit, size):
    (note,) = found(tmp_path, edit)
    assert "/Arm/joints/stand" in note and size in note and BASE in note and "in the world" in note


def test_a_frame_that_is_wrong_between_bodies_is_named(tmp_path):
    def edit(stage):
        UsdPhysics.Joint(stage.GetPrimAtPath(ELBOW)).GetLocalPos1Attr().Set(Gf.Vec3f(0, 0.05, 0))

    (note,) = found(tmp_path, edit)
    assert ELBOW in note and "0.05 m and 0 deg" in note and "Correct the frames" in note
