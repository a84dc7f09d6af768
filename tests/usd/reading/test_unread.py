"""Attributes of Calmotion that are authored in vain are told by every run."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from calmotion.usd.reading.context import switched_off_body
from calmotion.usd.reading.unread import unread_attributes
from pxr import Sdf, Usd, UsdPhysics
from small_shots import BASE, ELBOW, FORE, HAND, SHOULDER, UPPER, make_flexible, make_target, set_float, write_arm


def notes(tmp_path, edit):
    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    return [note for note in character.notes if ":calm:" in note or ".calm:" in note]


def test_a_misspelt_name_is_told_with_the_right_one(tmp_path):
    (note,) = notes(tmp_path, lambda stage: set_float(stage, ELBOW, "calm:motor:maxVelocty", 3.0))
    assert note.startswith(f"{ELBOW}.calm:motor:maxVelocty") and "calm:motor:maxVelocity" in note


def test_a_schema_that_is_not_applied_is_told(tmp_path):
    (note,) = notes(tmp_path, lambda stage: set_float(stage, "/Arm", "calm:retarget:tolerance", 0.5))
    assert "is not read" in note and "Apply CalmRetargetAPI" in note
    (note,) = notes(tmp_path, lambda stage: set_float(stage, FORE, "calm:flexible:elementSize", 0.01))
    assert "Apply CalmFlexibleBodyAPI" in note


def test_what_is_read_without_its_schema_is_told_to_the_validator_alone(tmp_path):
    def edit(stage):
        set_float(stage, ELBOW, "calm:motor:maxTorque", 3.0)

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert [motor.max_torque for motor in character.motors if motor.path == ELBOW] == [3.0]
    assert notes(tmp_path, edit) == []
    stage = Usd.Stage.Open(str(tmp_path / "arm.usda"))
    assert [error.attribute for error in unread_attributes(stage, declared=True)] == ["calm:motor:maxTorque"]


@pytest.mark.parametrize("path", ["/Arm", f"{FORE}/skin"])
def test_a_robot_that_stays_rigid_since_the_schema_is_on_another_prim_says_so(tmp_path, path):
    def edit(stage):
        make_flexible(stage)
        stage.GetPrimAtPath(FORE).RemoveAppliedSchema("CalmFlexibleBodyAPI")
        stage.GetPrimAtPath(path).AddAppliedSchema("CalmFlexibleBodyAPI")

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert not any(body.flexible for body in character.bodies)
    (note,) = [note for note in character.notes if "CalmFlexibleBodyAPI" in note]
    assert note.startswith(path) and "no effect" in note and "a body" in note


def test_a_motor_s_schema_on_a_body_is_told(tmp_path):
    character, _, _ = read_shot(
        str(write_arm(tmp_path / "arm.usda", lambda stage: stage.GetPrimAtPath(FORE).AddAppliedSchema("CalmMotorAPI")))
    )
    assert any(note.startswith(FORE) and "CalmMotorAPI belongs on a joint" in note for note in character.notes)


def notes_unused(tmp_path, edit):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0].notes


def authored(speed, force):
    def edit(stage):
        UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(FORE)).CreateAngularVelocityAttr((0.0, speed, 0.0))
        UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(UPPER)).CreateVelocityAttr((0.0, 0.0, speed))
        UsdPhysics.Joint(stage.GetPrimAtPath(ELBOW)).CreateBreakForceAttr(force)
        UsdPhysics.DriveAPI(stage.GetPrimAtPath(ELBOW), "angular").CreateTargetVelocityAttr(speed)

    return edit


def test_velocities_and_breaking_forces_are_named(tmp_path):
    found = [note for note in notes_unused(tmp_path, authored(90.0, 5.0)) if "is not used" in note]
    expected = {
        FORE: "physics:angularVelocity", UPPER: "physics:velocity", ELBOW: "physics:breakForce",
    }  # fmt: skip
    for path, name in expected.items():
        assert any(note.startswith(f"{path}: {name} is not used") for note in found)
    assert any("drive:angular:physics:targetVelocity is not used" in note for note in found) and len(found) == 4


def test_what_has_no_effect_anyway_is_not(tmp_path):
    for limit in (np.inf, float(np.finfo(np.float32).max)):
        assert not [note for note in notes_unused(tmp_path, authored(0.0, limit)) if "is not used" in note]


FLOATS = Sdf.ValueTypeNames.Double
OTHERS = [  # prim, attribute, a value that has an effect in its program, one that has none
    (FORE, "physxRigidBody:disableGravity", 1.0, 0.0, "gravity acts"),
    (FORE, "mjc:gravcomp", 1.0, 0.0, "gravity acts"),
    (FORE, "mjc:body:gravcomp", 0.5, 0.0, "gravity acts"),
    (FORE, "physxRigidBody:linearDamping", 0.2, 0.0, "brakes"),
    (FORE, "physxRigidBody:angularDamping", 0.2, 0.05, "brakes"),
    (FORE, "physxRigidBody:lockedRotAxis", 3.0, 0.0, "joint to the world"),
    (ELBOW, "physxLimit:angular:stiffness", 3.0, 0.0, "exact"),
    (ELBOW, "physxDrivePerformanceEnvelope:angular:speedEffortGradient", 3.0, 0.0, "torqueSpeedKnee"),
    (ELBOW, "isaac:physics:AccelerationLimit", 3.0, np.inf, "maxAcceleration"),
    (ELBOW, "isaac:physics:JerkLimit", 3.0, np.inf, "maxJerk"),
    (ELBOW, "physics:breakTorque", 3.0, np.inf, "break"),
]


@pytest.mark.parametrize(("path", "name", "value", "harmless", "why"), OTHERS, ids=[row[1] for row in OTHERS])
def test_attributes_of_other_programs_are_named_where_they_have_an_effect(tmp_path, path, name, value, harmless, why):
    def found(number):
        def edit(stage):
            stage.GetPrimAtPath(path).CreateAttribute(name, FLOATS).Set(number)

        return [note for note in notes_unused(tmp_path, edit) if f"{name} is not used" in note]

    (note,) = found(value)
    assert note.startswith(f"{path}: ") and why in note and not found(harmless)


def test_tendons_and_forces_of_physx_are_told(tmp_path):
    def edit(stage):
        stage.GetPrimAtPath(ELBOW).AddAppliedSchema("PhysxTendonAxisRootAPI:cable")
        stage.GetPrimAtPath(FORE).AddAppliedSchema("PhysxForceAPI")

    found = [note for note in notes_unused(tmp_path, edit) if "is not used" in note]
    assert [note.partition(" is not")[0] for note in found] == [
        f"{FORE}: PhysxForceAPI",
        f"{ELBOW}: PhysxTendonAxisRootAPI:cable",
    ]


def test_a_body_that_is_switched_off_is_told_since_its_joints_hold_to_the_world(tmp_path):
    def edit(stage):
        stage.GetPrimAtPath(BASE).GetAttribute("physics:rigidBodyEnabled").Set(False)

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert [body.path for body in character.bodies] == [UPPER, FORE]
    (note,) = [note for note in character.notes if "rigidBodyEnabled" in note]
    assert note.startswith(f"{SHOULDER}: holds to the world in place of {BASE}")


def test_a_target_on_a_body_that_is_switched_off_is_refused_with_the_body(tmp_path):
    def edit(stage):
        make_target(stage)
        stage.GetPrimAtPath(FORE).GetAttribute("physics:rigidBodyEnabled").Set(False)

    with pytest.raises(ShotError, match="switched off") as refused:
        read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert (refused.value.path, refused.value.attribute) == (FORE, "physics:rigidBodyEnabled")
    assert HAND in refused.value.found


def test_a_part_of_a_body_that_is_no_body_itself_is_not_told(tmp_path):
    def edit(stage):
        hand = stage.GetPrimAtPath(HAND)
        UsdPhysics.RigidBodyAPI.Apply(hand).CreateRigidBodyEnabledAttr(False)

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert len(character.bodies) == 3 and not any("rigidBodyEnabled" in note for note in character.notes)
    assert switched_off_body(Usd.Stage.Open(str(tmp_path / "arm.usda")).GetPrimAtPath(HAND)) is None
