"""A link without PhysicsRigidBodyAPI is named, and not a closed chain that does not meet."""

import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from pxr import UsdPhysics
from small_shots import BASE, FORE, make_flexible, write_arm


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
