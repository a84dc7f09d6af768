"""What of an imported robot can hardly be meant."""

import dataclasses

from calmotion.usd.reading.shot import read_shot
from calmotion_plugins.robot_import.masses import too_heavy
from calmotion_plugins.robot_import.robot import immovable_joints
from small_shots import FORE, write_arm


def test_a_robot_of_a_thousand_tonnes_has_meshes_in_millimetres(tmp_path):
    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda")))
    assert too_heavy(character) == immovable_joints(character) == ()
    bodies = tuple(
        dataclasses.replace(body, mass=dataclasses.replace(body.mass, mass=1e6)) if body.path == FORE else body
        for body in character.bodies
    )
    (told,) = too_heavy(dataclasses.replace(character, bodies=bodies))
    assert "1000 t" in told and FORE in told and "0.001" in told


def test_motors_without_a_range_are_told(tmp_path):
    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda")))
    held = tuple(dataclasses.replace(joint, lower=0.0, upper=0.0) for joint in character.joints)
    (told,) = immovable_joints(dataclasses.replace(character, joints=held))
    assert "/Arm/joints/" in told and "1 more" in told and "continuous" in told
