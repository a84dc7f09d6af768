"""Gear joints of PhysX: which hinge follows, by which ratio, from which pose."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from pxr import Sdf
from small_shots import BASE, ELBOW, FORE, SHOULDER, TARGET_POSITION, UPPER, set_float, write_arm

GEAR = "/Arm/joints/gear"


def undriven(stage, path):
    prim = stage.GetPrimAtPath(path)
    prim.RemoveAppliedSchema("PhysicsDriveAPI:angular")
    prim.RemoveProperty(TARGET_POSITION)


def gear(stage, ratio=2.0, bodies=(UPPER, FORE), hinges=(SHOULDER, ELBOW), path=GEAR):
    prim = stage.DefinePrim(path, "PhysxPhysicsGearJoint")
    for k in range(2):
        prim.CreateRelationship(f"physics:body{k}").SetTargets([bodies[k]])
        prim.CreateRelationship(f"physics:hinge{k}").SetTargets([hinges[k]])
    set_float(stage, path, "physics:gearRatio", ratio)


def read(tmp_path, edit):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))


@pytest.mark.parametrize("bodies", [(UPPER, FORE), (BASE, FORE)], ids=["upper and fore", "base and fore"])
def test_the_second_hinge_follows_the_first(tmp_path, bodies):
    # one of the hinges has a body of the gear as its body 0, the other one as its body 1
    character, animation, _ = read(tmp_path, lambda s: (undriven(s, ELBOW), gear(s, 2.0, bodies)))
    shoulder, elbow = character.motors
    assert (elbow.path, elbow.follows.leader) == (ELBOW, 0) and shoulder.follows is None
    assert elbow.follows.ratio == pytest.approx(2.0) and elbow.follows.offset == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(animation.tracks[1].values, 2.0 * animation.tracks[0].values, atol=1e-9)


def test_two_wheels_on_one_frame_turn_against_each_other(tmp_path):
    # both hinges carry the bodies of the gear on their body 1: the forearm hangs on the base here
    def edit(stage):
        undriven(stage, ELBOW)
        stage.GetPrimAtPath(ELBOW).GetRelationship("physics:body0").SetTargets([BASE])
        stage.GetPrimAtPath(ELBOW).GetAttribute("physics:localPos0").Set((0.4, 0.0, 0.0))
        gear(stage, 2.0)

    character, _, _ = read(tmp_path, edit)
    assert character.motors[1].follows.ratio == pytest.approx(-2.0)


def test_the_first_hinge_follows_where_the_second_is_driven(tmp_path):
    character, _, _ = read(tmp_path, lambda s: (undriven(s, SHOULDER), gear(s, 2.0)))
    shoulder = next(motor for motor in character.motors if motor.path == SHOULDER)
    assert character.motors[shoulder.follows.leader].path == ELBOW
    assert shoulder.follows.ratio == pytest.approx(0.5)


def test_an_imported_robot_drives_the_first_hinge_of_a_gear_alone(tmp_path):
    robot = write_arm(tmp_path / "arm.usda", lambda s: (undriven(s, SHOULDER), undriven(s, ELBOW), gear(s)))
    robots = pytest.importorskip("calmotion_plugins.robot_import")
    made = robots.import_robot(robot, layer=tmp_path / "shot.usda")
    followers = [motor.path for motor in made.character.motors if motor.follows is not None]
    assert len(made.character.motors) == 2 and followers == [ELBOW]


BROKEN = {
    "no motor": (lambda s: (undriven(s, SHOULDER), undriven(s, ELBOW), gear(s)), "that no motor drives"),
    "a ratio of zero": (lambda s: gear(s, 0.0), "not zero"),
    "one hinge twice": (lambda s: gear(s, hinges=(ELBOW, ELBOW)), "couples two hinges"),
    "no hinge": (lambda s: gear(s, hinges=("/Arm/joints/stand", ELBOW)), "couples two hinges"),
    "other bodies": (lambda s: gear(s, bodies=(FORE, FORE)), "on the bodies that its hinges turn"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_gear_that_means_nothing_is_refused(tmp_path, name):
    edit, message = BROKEN[name]
    with pytest.raises(ShotError, match=message) as refused:
        read(tmp_path, edit)
    assert refused.value.path == GEAR and refused.value.remedy


def test_a_gear_that_is_switched_off_couples_nothing(tmp_path):
    def edit(stage):
        gear(stage)
        stage.GetPrimAtPath(GEAR).CreateAttribute("physics:jointEnabled", Sdf.ValueTypeNames.Bool).Set(False)

    assert all(motor.follows is None for motor in read(tmp_path, edit)[0].motors)
