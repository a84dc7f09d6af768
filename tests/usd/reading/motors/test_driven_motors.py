"""Which joints are motors, and their limits."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from pxr import Sdf, UsdPhysics
from small_shots import ELBOW, SHOULDER, TARGET_POSITION, UPPER, Scale, set_float, write_arm


def read(tmp_path, edit=None, scale=None):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit, scale)))


def clear(stage, path: str) -> None:
    stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION).Clear()


def test_limits_are_si_and_the_smaller_torque_counts(tmp_path):
    scale = Scale(0.01, 0.001)

    def edit(stage):
        prim = stage.GetPrimAtPath(ELBOW)
        prim.AddAppliedSchema("CalmMotorAPI")
        set_float(stage, ELBOW, "calm:motor:maxVelocity", 180.0)
        set_float(stage, ELBOW, "calm:motor:maxAcceleration", 90.0)
        set_float(stage, ELBOW, "calm:motor:maxJerk", 45.0)
        set_float(stage, ELBOW, "calm:motor:maxTorque", 3e7)  # 3 N m in g cm^2/s^2
        prim.CreateAttribute("calm:motor:optimize", Sdf.ValueTypeNames.Bool).Set(False)
        UsdPhysics.DriveAPI(prim, "angular").CreateMaxForceAttr(2e7)

    character, _, _ = read(tmp_path, edit, scale)
    shoulder, elbow = character.motors
    assert elbow.path == ELBOW and elbow.attribute == TARGET_POSITION
    assert character.joints[elbow.joint].path == ELBOW
    assert elbow.max_velocity == pytest.approx(np.pi) and elbow.max_acceleration == pytest.approx(np.pi / 2)
    assert elbow.max_jerk == pytest.approx(np.pi / 4)
    assert elbow.max_torque == pytest.approx(2.0) and not elbow.optimize
    assert shoulder.optimize and np.isinf([shoulder.max_velocity, shoulder.max_torque]).all()


@pytest.mark.parametrize("schemas", [(), ("CalmMotorAPI",)], ids=["drive", "servo"])
def test_a_drive_that_is_not_animated_holds_its_value(tmp_path, schemas):
    def edit(stage):
        clear(stage, ELBOW)
        for schema in schemas:
            stage.GetPrimAtPath(ELBOW).AddAppliedSchema(schema)
        stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION).Set(45.0)

    character, animation, _ = read(tmp_path, edit)
    assert len(character.motors) == 2
    assert np.allclose(animation.tracks[1].values, np.pi / 4)
    assert any("holds 45 degrees" in note for note in character.notes)


def test_a_motor_of_ours_that_has_no_drive_and_no_animation_holds_the_pose_of_its_bodies(tmp_path):
    def edit(stage):
        prim = stage.GetPrimAtPath(ELBOW)
        prim.RemoveAPI(UsdPhysics.DriveAPI, "angular")
        prim.RemoveProperty(TARGET_POSITION)
        prim.AddAppliedSchema("CalmMotorAPI")

    character, animation, _ = read(tmp_path, edit)
    assert len(character.motors) == 2 and np.ptp(animation.tracks[1].values) == 0.0
    assert any(ELBOW in note and "holds the pose of its bodies" in note for note in character.notes)


def test_a_drive_that_pulls_nowhere_leaves_its_joint_free(tmp_path):
    character, animation, _ = read(tmp_path, lambda stage: clear(stage, ELBOW))
    assert [motor.path for motor in character.motors] == [SHOULDER] and len(animation.tracks) == 1
    assert any("moves freely" in note for note in character.notes)


def test_a_drive_with_only_a_stiffness_keeps_angle_zero(tmp_path):
    def edit(stage):
        clear(stage, ELBOW)
        UsdPhysics.DriveAPI(stage.GetPrimAtPath(ELBOW), "angular").CreateStiffnessAttr(100.0)

    _, animation, _ = read(tmp_path, edit)
    assert np.array_equal(animation.tracks[1].values, [0.0, 0.0])


def test_an_actuator_of_a_conversion_makes_a_motor_that_holds_its_pose_until_it_is_animated(tmp_path):
    def edit(stage):
        clear(stage, ELBOW)
        stage.GetPrimAtPath(ELBOW).RemoveAPI(UsdPhysics.DriveAPI, "angular")
        actuator = stage.DefinePrim("/Arm/actuator", "MjcActuator")
        actuator.CreateRelationship("mjc:target").SetTargets([ELBOW])

    character, animation, _ = read(tmp_path, edit)
    assert [motor.path for motor in character.motors] == [SHOULDER, ELBOW]
    assert np.allclose(animation.tracks[1].values, 0.0, atol=1e-7)
    assert any(ELBOW in note and "an actuator drives it" in note for note in character.notes)


def test_a_motor_inside_an_instance_is_refused(tmp_path):
    write_arm(tmp_path / "robot.usda")
    shot = tmp_path / "shot.usda"
    shot.write_text(
        "#usda 1.0\n(\n startTimeCode = 0\n endTimeCode = 24\n timeCodesPerSecond = 24\n metersPerUnit = 1\n)\n"
        'def Xform "Robot" (instanceable = true\n references = @./robot.usda@</Arm>) {}\n'
    )
    with pytest.raises(ShotError, match="inside an instance") as caught:
        read_shot(str(shot))
    assert "instanceable" in caught.value.remedy


def test_the_body_of_a_motor_is_moved_by_it(tmp_path):
    character, _, _ = read(tmp_path)
    joint = character.joints[character.motors[0].joint]
    assert character.bodies[joint.body1].path == UPPER


def test_a_range_of_time_is_locked_by_samples_of_optimize(tmp_path):
    def edit(stage):
        prim = stage.GetPrimAtPath(ELBOW)
        prim.AddAppliedSchema("CalmMotorAPI")
        attribute = prim.CreateAttribute("calm:motor:optimize", Sdf.ValueTypeNames.Bool)
        start = stage.GetStartTimeCode()
        for code, value in ((start, True), (start + 6, False), (start + 12, True)):
            attribute.Set(value, code)

    character, animation, _ = read(tmp_path, edit)
    assert all(motor.optimize for motor in character.motors)
    (track,) = animation.free
    assert character.motors[track.motor].path == ELBOW
    ((first, last),) = track.locked(float(animation.frame_times[-1]))
    assert np.allclose([first, last], np.array([6.0, 12.0]) / 24.0)


def test_samples_that_lock_all_the_time_lock_the_motor(tmp_path):
    def edit(stage):
        prim = stage.GetPrimAtPath(ELBOW)
        prim.AddAppliedSchema("CalmMotorAPI")
        prim.CreateAttribute("calm:motor:optimize", Sdf.ValueTypeNames.Bool).Set(False, 3.0)

    character, animation, _ = read(tmp_path, edit)
    assert not character.motors[1].optimize and animation.free == ()


@pytest.mark.parametrize(("converted", "remedy"), [(True, "Import the robot's .xml file"), (False, "Remove one")])
def test_two_motors_between_the_same_bodies_are_refused(tmp_path, converted, remedy):
    """A conversion of an MJCF body with several joints; removing the drive of one would leave both joints."""

    def edit(stage):
        layer = stage.GetRootLayer()
        Sdf.CopySpec(layer, ELBOW, layer, f"{ELBOW}2")
        if converted:
            stage.GetPrimAtPath(f"{ELBOW}2").AddAppliedSchema("MjcJointAPI")

    with pytest.raises(ShotError, match="same pair") as refused:
        read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert refused.value.remedy.startswith(remedy)
