"""Joints: frames, axes, limits, the world, and what is refused."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import WORLD
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd.reading import read_shot
from generic_arm import generic
from pxr import Gf, Sdf, UsdGeom, UsdPhysics
from small_shots import BASE, ELBOW, FORE, LENGTH, SHOULDER, UPPER, Scale, write_arm


def read(tmp_path, edit=None):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0]


def joint(character, path):
    return next(j for j in character.joints if j.path == path)


def axis(frame) -> np.ndarray:
    return rotation_from_quaternion(frame.rotation)[:, 2]


def world_anchor(character, joint, side: int) -> np.ndarray:
    body, frame = ((joint.body0, joint.frame0), (joint.body1, joint.frame1))[side]
    if body == WORLD:
        return frame.position
    rest = character.bodies[body].rest
    return rest.position + rotation_from_quaternion(rest.rotation) @ frame.position


@pytest.mark.parametrize(("name", "direction"), [("X", [1, 0, 0]), ("Y", [0, 1, 0]), ("Z", [0, 0, 1])])
def test_the_axis_becomes_z_of_both_frames(tmp_path, name, direction):
    found = joint(
        read(tmp_path, lambda s: UsdPhysics.RevoluteJoint(s.GetPrimAtPath(ELBOW)).GetAxisAttr().Set(name)), ELBOW
    )
    assert np.allclose(axis(found.frame0), direction, atol=1e-12)
    assert np.allclose(axis(found.frame1), direction, atol=1e-12)


def test_both_anchors_meet_at_the_rest_pose_and_limits_are_radians(tmp_path):
    character = read(tmp_path)
    found = joint(character, ELBOW)
    assert np.allclose(world_anchor(character, found, 0), [LENGTH, 0, 1], atol=1e-6)
    assert np.allclose(world_anchor(character, found, 1), [LENGTH, 0, 1], atol=1e-6)
    assert (found.lower, found.upper) == pytest.approx((np.deg2rad(-90), np.deg2rad(120)))


def test_the_scale_of_a_body_is_in_its_anchors(tmp_path):
    def edit(stage):
        UsdGeom.Xformable(stage.GetPrimAtPath(UPPER)).AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
        UsdPhysics.RevoluteJoint(stage.GetPrimAtPath(ELBOW)).GetLocalPos0Attr().Set(Gf.Vec3f(LENGTH / 2, 0, 0))

    assert np.allclose(joint(read(tmp_path, edit), ELBOW).frame0.position, [LENGTH, 0, 0], atol=1e-6)


def test_a_prim_that_is_not_a_rigid_body_is_the_world(tmp_path):
    def edit(stage):
        pedestal = UsdGeom.Xform.Define(stage, "/Arm/pedestal")
        pedestal.AddTranslateOp().Set(Gf.Vec3d(0, 2, 0))
        pedestal.AddRotateZOp().Set(90.0)
        stand = UsdPhysics.FixedJoint(stage.GetPrimAtPath("/Arm/joints/stand"))
        stand.CreateBody0Rel().SetTargets(["/Arm/pedestal"])
        stand.GetLocalPos0Attr().Set(Gf.Vec3f(1, 0, 0))

    found = joint(read(tmp_path, edit), "/Arm/joints/stand")
    assert found.body0 == WORLD
    assert np.allclose(found.frame0.position, [0, 3, 0], atol=1e-6)
    assert np.allclose(rotation_from_quaternion(found.frame0.rotation)[:, 0], [0, 1, 0], atol=1e-6)


def test_a_prim_below_a_body_is_carried_by_it(tmp_path):
    def edit(stage):
        socket = UsdGeom.Xform.Define(stage, f"{UPPER}/socket")
        socket.AddTranslateOp().Set(Gf.Vec3d(0.3, 0, 0))
        elbow = UsdPhysics.RevoluteJoint(stage.GetPrimAtPath(ELBOW))
        elbow.GetBody0Rel().SetTargets([f"{UPPER}/socket"])
        elbow.GetLocalPos0Attr().Set(Gf.Vec3f(0.1, 0, 0))

    character = read(tmp_path, edit)
    found = joint(character, ELBOW)
    assert character.bodies[found.body0].path == UPPER
    assert np.allclose(found.frame0.position, [0.4, 0, 0], atol=1e-6)


def test_a_joint_that_names_the_world_second_is_turned_round_with_the_same_angle(tmp_path):
    def swapped(stage):
        stage.RemovePrim("/Arm/joints/stand")
        stage.RemovePrim(BASE)
        shoulder = UsdPhysics.RevoluteJoint(stage.GetPrimAtPath(SHOULDER))
        shoulder.GetBody0Rel().SetTargets([UPPER])
        shoulder.GetBody1Rel().ClearTargets(True)
        shoulder.GetLocalPos0Attr().Set(Gf.Vec3f(0, 0, 0))
        shoulder.GetLocalPos1Attr().Set(Gf.Vec3f(0, 0, 1))

    found = joint(read(tmp_path, swapped), SHOULDER)
    assert found.body0 == WORLD and np.allclose(found.frame0.position, [0, 0, 1])
    # "world relative to arm, about y" is "arm relative to world, about -y": one angle, its axis turned over
    assert np.allclose(axis(found.frame0), [0, -1, 0], atol=1e-12)
    assert np.allclose(axis(found.frame1), [0, -1, 0], atol=1e-12)
    assert (found.lower, found.upper) == pytest.approx((np.deg2rad(-90), np.deg2rad(120)))


def test_a_disabled_joint_is_not_there(tmp_path):
    def edit(stage):
        extra = UsdPhysics.PrismaticJoint.Define(stage, "/Arm/joints/slide")
        extra.CreateBody0Rel().SetTargets([BASE])
        extra.CreateBody1Rel().SetTargets([FORE])
        extra.CreateJointEnabledAttr(False)

    assert len(read(tmp_path, edit).joints) == 3


def test_a_joint_that_closes_a_chain_is_read_as_a_joint(tmp_path):
    def edit(stage):
        extra = UsdPhysics.RevoluteJoint.Define(stage, "/Arm/joints/loop")
        extra.CreateBody0Rel().SetTargets([BASE])
        extra.CreateBody1Rel().SetTargets([FORE])
        extra.CreateExcludeFromArticulationAttr(True)

    joints = read(tmp_path, edit).joints
    assert len(joints) == 4
    assert [joint.closes_chain for joint in joints].count(True) == 1


def test_a_ball_is_read(tmp_path):
    def edit(stage):
        extra = UsdPhysics.SphericalJoint.Define(stage, "/Arm/joints/ball")
        extra.CreateBody0Rel().SetTargets([BASE])
        extra.CreateBody1Rel().SetTargets([FORE])

    (ball,) = (joint for joint in read(tmp_path, edit).joints if joint.path == "/Arm/joints/ball")
    assert ball.kind == "spherical" and ball.lower == -np.inf


@pytest.mark.parametrize("meters", [1.0, 0.01])
def test_a_slider_is_read_with_its_axis_and_limits(tmp_path, meters):
    def edit(stage):
        extra = UsdPhysics.PrismaticJoint.Define(stage, "/Arm/joints/slide")
        extra.CreateBody0Rel().SetTargets([BASE])
        extra.CreateBody1Rel().SetTargets([FORE])
        extra.CreateAxisAttr("X")
        extra.CreateLowerLimitAttr(-0.2 / meters)
        extra.CreateUpperLimitAttr(0.3 / meters)

    path = write_arm(tmp_path / "arm.usda", edit, Scale(meters))
    joints = read_shot(str(path))[0].joints
    (slide,) = (joint for joint in joints if joint.path == "/Arm/joints/slide")
    assert slide.kind == "prismatic" and (slide.lower, slide.upper) == pytest.approx((-0.2, 0.3))
    assert np.allclose(axis(slide.frame0), [1, 0, 0], atol=1e-12)


def test_other_joints_of_the_character_are_not_supported(tmp_path):
    def edit(stage):
        extra = UsdPhysics.DistanceJoint.Define(stage, "/Arm/joints/other")
        extra.CreateBody0Rel().SetTargets([BASE])
        extra.CreateBody1Rel().SetTargets([FORE])

    with pytest.raises(ShotError, match="not supported") as caught:
        read(tmp_path, edit)
    assert caught.value.path == "/Arm/joints/other" and "physics:jointEnabled" in caught.value.remedy


def test_a_joint_that_locks_nothing_is_left_out(tmp_path):
    def edit(stage):
        extra = UsdPhysics.Joint.Define(stage, "/Arm/joints/other")
        extra.CreateBody0Rel().SetTargets([BASE])
        extra.CreateBody1Rel().SetTargets([FORE])

    character = read(tmp_path, edit)
    assert len(character.joints) == 3
    assert any("/Arm/joints/other: it leaves all directions free" in note for note in character.notes)


@pytest.mark.parametrize("locked", [(1.0, -1.0), (0.0, 0.0)])
@pytest.mark.parametrize("freedom", ["rotX", "rotY", "rotZ"])
def test_a_generic_joint_with_one_free_rotation_is_a_hinge(tmp_path, freedom, locked):
    def hinge(stage):
        UsdPhysics.RevoluteJoint(stage.GetPrimAtPath(ELBOW)).GetAxisAttr().Set(freedom[-1])

    expected, animation, _ = read_shot(str(write_arm(tmp_path / "hinge.usda", hinge)))
    read_generic = read_shot(str(write_arm(tmp_path / "generic.usda", lambda s: generic(s, ELBOW, [freedom], locked))))
    character, same, _ = read_generic
    one, other = joint(expected, ELBOW), joint(character, ELBOW)
    assert other.kind == "revolute" and (other.lower, other.upper) == (one.lower, one.upper)
    for side in ("frame0", "frame1"):
        assert np.allclose(getattr(one, side).position, getattr(other, side).position)
        assert np.allclose(getattr(one, side).rotation, getattr(other, side).rotation)
    for track, again in zip(animation.tracks, same.tracks, strict=True):
        assert np.array_equal(track.values, again.values)
    assert character.motors[1].attribute == f"drive:{freedom}:physics:targetPosition"
    assert any(ELBOW in note and "generic joint, revolute" in note for note in character.notes)


def test_a_generic_joint_without_freedom_is_fixed_and_with_three_rotations_spherical(tmp_path):
    for free, kind in (([], "fixed"), (["rotX", "rotY", "rotZ"], "spherical")):
        found = joint(read(tmp_path, lambda s, free=free: generic(s, ELBOW, free)), ELBOW)
        assert found.kind == kind


def test_limits_the_wrong_way_round_limit_nothing_and_are_named(tmp_path):
    def edit(stage):
        hinge = UsdPhysics.RevoluteJoint(stage.GetPrimAtPath(ELBOW))
        hinge.GetLowerLimitAttr().Set(90.0)
        hinge.GetUpperLimitAttr().Set(-90.0)

    character, *_ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    joint = next(joint for joint in character.joints if joint.path == ELBOW)
    assert (joint.lower, joint.upper) == (-np.inf, np.inf)
    assert any(ELBOW in note and "lower limit is above its upper one" in note for note in character.notes)


ROOT = """#usda 1.0
(
    defaultPrim = "Arm"
    metersPerUnit = 1
    upAxis = "Z"
    startTimeCode = 0
    endTimeCode = 24
)
def "Arm" (
    references = @./robot.usda@</Arm>
)
{
%s
}
"""


def referenced(tmp_path, body="", over=""):
    """The arm without one of its bodies, which is beside it and out of the reference's reach."""

    def edit(stage):
        layer = stage.GetRootLayer()
        Sdf.CopySpec(layer, FORE, layer, "/Fore")
        stage.RemovePrim(FORE)
        UsdPhysics.Joint(stage.GetPrimAtPath(ELBOW)).GetBody1Rel().SetTargets([body] if body else [])

    write_arm(tmp_path / "robot.usda", edit)
    (tmp_path / "shot.usda").write_text(ROOT % over)
    return str(tmp_path / "shot.usda")


def test_a_body_that_a_reference_does_not_reach_is_refused(tmp_path):
    with pytest.raises(ShotError, match="outside of what is referenced") as error:
        read_shot(referenced(tmp_path, "/Fore"))
    assert (error.value.path, error.value.attribute) == (ELBOW, "physics:body1")
    assert "/Fore in robot.usda" in error.value.found


@pytest.mark.parametrize("edit", ["rel physics:body1 = []", "delete rel physics:body1 = </Fore>"])
def test_an_end_that_a_stronger_layer_gives_to_the_world_is_there(tmp_path, edit):
    path = referenced(tmp_path, "/Fore", f'over "joints"\n{{\nover "elbow"\n{{\n{edit}\n}}\n}}')
    character, _, _ = read_shot(path)
    (elbow,) = [joint for joint in character.joints if joint.path == ELBOW]
    assert elbow.body0 == -1


@pytest.mark.parametrize("kind", ["Xform", "Scope", ""])
def test_places_in_the_world_are_ends(tmp_path, kind):
    def edit(stage):
        stage.DefinePrim("/Ground", kind)
        UsdPhysics.Joint(stage.GetPrimAtPath("/Arm/joints/stand")).CreateBody0Rel().SetTargets(["/Ground"])

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert len(character.joints) == 3
