"""Joints that hold bodies elsewhere than their transforms show them."""

import pytest
import small_shots as shots
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from pxr import Gf, Sdf, UsdGeom, UsdPhysics
from shot_edits import undriven
from small_shots import BASE, ELBOW, FORE, SHOULDER, TARGET_POSITION, make_flexible, write_arm


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


def kinematic(*paths):
    def edit(stage):
        for path in paths:
            UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(path)).CreateKinematicEnabledAttr(True)

    return edit


def read(tmp_path, *edits):
    def edit(stage):
        for one in edits:
            one(stage)

    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0]


def test_a_root_may_be(tmp_path):
    assert len(read(tmp_path, kinematic(BASE)).joints) == 3
    assert len(read(tmp_path, kinematic(BASE), lambda stage: stage.RemovePrim("/Arm/joints/stand")).joints) == 3


def test_two_handles_between_which_something_hangs_may_be(tmp_path):
    def moving(stage):
        place = UsdGeom.Xformable(stage.GetPrimAtPath(BASE)).GetOrderedXformOps()[0]
        for code in (0, 24):
            place.Set(Gf.Vec3d(0.001 * code, 0.0, 1.0), code)
        stage.RemovePrim("/Arm/joints/stand")

    character = read(tmp_path, undriven, moving, kinematic(BASE, FORE))
    assert sum(joint.body0 == -1 for joint in character.joints) == 2


def test_a_motor_that_gives_may_be_between(tmp_path):
    def soft(stage):
        for path in (SHOULDER, ELBOW):
            prim = stage.GetPrimAtPath(path)
            prim.AddAppliedSchema("CalmMotorAPI")
            prim.CreateAttribute("calm:motor:model", Sdf.ValueTypeNames.Token).Set("drive")
            prim.CreateAttribute("drive:angular:physics:stiffness", Sdf.ValueTypeNames.Float).Set(10.0)
            assert prim.GetAttribute(TARGET_POSITION)

    assert len(read(tmp_path, kinematic(FORE), soft).joints) == 4


def without_body(path, *edits):
    def edit(stage):
        for one in edits:
            one(stage)
        stage.GetPrimAtPath(path).RemoveAppliedSchema("PhysicsRigidBodyAPI")

    return edit


@pytest.mark.parametrize("edits", [(), (make_flexible,)], ids=["mass", "flexible"])
def test_a_link_that_is_no_body_is_refused(tmp_path, edits):
    with pytest.raises(ShotError, match="is no rigid body") as error:
        read_shot(str(write_arm(tmp_path / "arm.usda", without_body(FORE, *edits))))
    assert error.value.path == FORE and "PhysicsRigidBodyAPI" in error.value.remedy


def test_a_base_that_is_no_body_carries_the_robot_and_is_told(tmp_path):
    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", without_body(BASE))))
    assert len(character.bodies) == 2
    assert any(note.startswith(f"{BASE}: it has PhysicsMassAPI but is no rigid body") for note in character.notes)


def test_a_base_that_is_switched_off_is_meant(tmp_path):
    def edit(stage):
        UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(BASE)).CreateRigidBodyEnabledAttr(False)

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert not any("is no rigid body, so" in note for note in character.notes)
