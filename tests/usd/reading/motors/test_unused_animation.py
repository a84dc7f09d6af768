"""An animated drive that moves nothing is refused with the joint and what to animate instead."""

import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from one_hinge import HINGE, ONE_HINGE
from pxr import Sdf, UsdPhysics
from small_shots import ELBOW, write_arm

FIXED = ("transX", "transY", "transZ", "rotX", "rotY")
REVOLUTE = 'PhysicsRevoluteJoint "Hinge" (prepend apiSchemas = ["PhysicsDriveAPI:angular"])'
AXIS = '        uniform token physics:axis = "Z"\n'


def generic(locked=FIXED, drive="rotZ", low="1", high="-1"):
    """The hinge as a generic joint."""
    limits = "".join(
        f"        float limit:{name}:physics:low = {low}\n        float limit:{name}:physics:high = {high}\n"
        for name in locked
    )
    applied = ", ".join(
        f'"{schema}"' for schema in (f"PhysicsDriveAPI:{drive}", *map("PhysicsLimitAPI:{}".format, locked))
    )
    text = ONE_HINGE.replace(REVOLUTE, f'PhysicsJoint "Hinge" (prepend apiSchemas = [{applied}])').replace(AXIS, limits)
    return text.replace("drive:angular", f"drive:{drive}")


def read(tmp_path, text):
    (tmp_path / "shot.usda").write_text(text)
    return read_shot(str(tmp_path / "shot.usda"))


CASES = {
    "a generic joint by its angular drive": (generic(drive="angular"), "drive:rotZ:physics:targetPosition"),
    "a generic joint about another axis": (generic(drive="rotX"), "drive:rotZ:physics:targetPosition"),
    "a generic joint with two axes about the third": (generic((*FIXED[:3], "rotZ")), "Lock all directions but rotZ"),
    "a generic joint that is fixed": (generic((*FIXED, "rotZ")), "Lock all directions but rotZ"),
    "a hinge along its axis": (
        ONE_HINGE.replace("DriveAPI:angular", "DriveAPI:linear").replace("drive:angular", "drive:linear"),
        "drive:angular:physics:targetPosition",
    ),
    "a ball joint": (ONE_HINGE.replace("RevoluteJoint", "SphericalJoint").replace(AXIS, ""), "PhysicsRevoluteJoint"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_drive_in_a_direction_in_which_nothing_moves_is_refused(tmp_path, name):
    text, remedy = CASES[name]
    with pytest.raises(ShotError, match="in which its joint does not move") as error:
        read(tmp_path, text)
    assert error.value.path == HINGE and error.value.attribute.endswith("targetPosition")
    assert remedy in error.value.remedy


def test_a_joint_without_bodies_is_named_where_nothing_else_is_driven(tmp_path):
    with pytest.raises(ShotError, match="connects no body") as error:
        read(tmp_path, ONE_HINGE.replace("        rel physics:body1 = </Robot/Link>\n", ""))
    assert (error.value.path, error.value.attribute) == (HINGE, "physics:body1")


def test_one_of_several_motors_is_not_lost_without_a_word(tmp_path):
    def edit(stage):
        prim = stage.GetPrimAtPath(ELBOW)
        prim.RemoveAppliedSchema("PhysicsDriveAPI:angular")
        prim.AddAppliedSchema("PhysicsDriveAPI:linear")
        layer = stage.GetRootLayer()
        old, new = (f"{ELBOW}.drive:{kind}:physics:targetPosition" for kind in ("angular", "linear"))
        Sdf.CopySpec(layer, old, layer, new)
        prim.RemoveProperty("drive:angular:physics:targetPosition")

    with pytest.raises(ShotError, match="in which its joint does not move") as error:
        read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert error.value.path == ELBOW


@pytest.mark.parametrize(("low", "high"), [("1", "-1"), ("0", "0"), ("-0.005", "0.005"), ("0", "0.01")])
def test_directions_with_no_play_to_speak_of_are_locked(tmp_path, low, high):
    text = generic(FIXED[3:], low=low, high=high)
    locked = "".join(
        f"        float limit:{name}:physics:low = 0\n        float limit:{name}:physics:high = 0\n"
        for name in FIXED[:3]
    )
    character, _, _ = read(tmp_path, text.replace("        rel physics:body1", f"{locked}        rel physics:body1"))
    assert [joint.kind for joint in character.joints] == ["revolute"] and len(character.motors) == 1


def test_a_little_play_is_not_locked(tmp_path):
    character, _, _ = read(tmp_path, generic(low="-0.1", high="0.1"))
    assert len(character.joints) == 6 and [motor.path for motor in character.motors] == [f"{HINGE}.rotZ"]


def test_a_second_drive_that_moves_nothing_is_told(tmp_path):
    def edit(stage):
        drive = UsdPhysics.DriveAPI.Apply(stage.GetPrimAtPath(ELBOW), "linear").CreateTargetPositionAttr()
        for code in (0.0, 24.0):
            drive.Set(0.01 * code, code)

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert any(note.startswith(f"{ELBOW}: drive:linear:") and "not used" in note for note in character.notes)
