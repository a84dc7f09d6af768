"""Attributes of Calmotion that are authored in vain are told by every run."""

import pytest
from calmotion.usd.reading import read_shot
from calmotion.usd.reading.unread import unread_attributes
from pxr import Usd
from small_shots import ELBOW, FORE, make_flexible, make_target, set_float, write_arm


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


def test_a_shot_in_order_has_none(tmp_path):
    def edit(stage):
        make_flexible(stage)
        make_target(stage)

    assert notes(tmp_path, edit) == []


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
