"""Joints that are geared to others, in several dialects."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from calmotion.usd.reading.motors.gearing import Gear, resolve
from pxr import Sdf, UsdPhysics
from small_shots import ELBOW, FORE, SHOULDER, TARGET_POSITION, Scale, set_float, write_arm

FINGER = "/Arm/joints/finger"
RADIANS = np.pi / 180.0


def read(tmp_path, edit, scale=None):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit, scale)))


def passive(stage) -> None:
    prim = stage.GetPrimAtPath(ELBOW)
    prim.GetAttribute(TARGET_POSITION).Clear()
    prim.RemoveAppliedSchema("PhysicsDriveAPI:angular")


def gear(stage, leader: str, **values: float) -> None:
    prim = stage.GetPrimAtPath(ELBOW)
    prim.CreateRelationship(leader.replace("__", ":")).SetTargets([SHOULDER])
    for name, value in values.items():
        set_float(stage, ELBOW, name.replace("__", ":"), value)


def newton(stage):
    gear(stage, "newton:mimicJoint", newton__mimicCoef0=10.0, newton__mimicCoef1=-0.5)


def mujoco(stage):
    gear(stage, "mjc:target", mjc__coef0=10.0 * RADIANS, mjc__coef1=-0.5)


def physx(stage):
    gear(
        stage,
        "physxMimicJoint:rotX:referenceJoint",
        physxMimicJoint__rotX__gearing=0.5,
        physxMimicJoint__rotX__offset=-10.0,
    )


@pytest.mark.parametrize("dialect", [newton, mujoco, physx], ids=lambda d: d.__name__)
def test_a_geared_joint_follows_its_leader(tmp_path, dialect):
    def edit(stage):
        passive(stage)
        dialect(stage)

    character, animation, _ = read(tmp_path, edit)
    shoulder, elbow = character.motors
    assert shoulder.follows is None and elbow.follows.leader == 0
    assert elbow.follows.ratio == pytest.approx(-0.5) and elbow.follows.offset == pytest.approx(10.0 * RADIANS)
    led = animation.tracks[0]
    assert np.allclose(animation.tracks[1].values, 10.0 * RADIANS - 0.5 * led.values, atol=1e-8)


def test_the_dialect_of_higher_priority_wins(tmp_path):
    def edit(stage):
        passive(stage)
        newton(stage)
        gear(stage, "physxMimicJoint:rotX:referenceJoint", physxMimicJoint__rotX__gearing=7.0)

    character, _, _ = read(tmp_path, edit)
    assert character.motors[1].follows.ratio == pytest.approx(-0.5)


def test_a_disabled_gear_is_ignored(tmp_path):
    def edit(stage):
        newton(stage)
        stage.GetPrimAtPath(ELBOW).CreateAttribute("newton:mimicEnabled", Sdf.ValueTypeNames.Bool).Set(False)

    character, _, _ = read(tmp_path, edit)
    assert character.motors[1].follows is None


# 5 mm a turn; cm for radians in MuJoCo and Newton, whose importer takes it so, cm for degrees in PhysX
RACKS = {
    "newton": ("newton:mimicJoint", {"newton__mimicCoef1": 0.25 / np.pi}),
    "mujoco": ("mjc:target", {"mjc__coef1": 0.25 / np.pi}),
    "physx": ("physxMimicJoint:X:referenceJoint", {"physxMimicJoint__X__gearing": -0.5 / 360.0}),
}


@pytest.mark.parametrize("dialect", RACKS)
def test_a_rack_is_geared_in_metres_for_radians(tmp_path, dialect):
    scale, (leader, ratio) = Scale(0.01, 1.0), RACKS[dialect]

    def edit(stage):
        stage.RemovePrim(ELBOW)
        joint = UsdPhysics.PrismaticJoint.Define(stage, ELBOW)
        joint.CreateBody0Rel().SetTargets(["/Arm/upper"])
        joint.CreateBody1Rel().SetTargets([FORE])
        joint.CreateAxisAttr("X")
        gear(stage, leader, **ratio)

    character, _, _ = read(tmp_path, edit, scale)
    assert character.motors[1].linear
    assert character.motors[1].follows.ratio == pytest.approx(0.005 / (2.0 * np.pi))


def test_the_animation_of_a_geared_joint_is_ignored_with_a_note(tmp_path):
    character, animation, _ = read(tmp_path, newton)
    assert np.allclose(animation.tracks[1].values, 10.0 * RADIANS - 0.5 * animation.tracks[0].values)
    assert any(ELBOW in note and "not used" in note for note in character.notes)


def test_the_joint_that_leads_follows_where_only_the_other_is_driven(tmp_path):
    def edit(stage):
        newton(stage)
        stage.GetPrimAtPath(SHOULDER).RemoveAppliedSchema("PhysicsDriveAPI:angular")
        stage.GetPrimAtPath(SHOULDER).GetAttribute(TARGET_POSITION).Clear()

    character, animation, _ = read(tmp_path, edit)
    shoulder, elbow = character.motors
    assert elbow.follows is None and shoulder.follows.ratio == pytest.approx(-2.0)
    led = animation.tracks[1]
    assert np.allclose(led.values, 10.0 * RADIANS - 0.5 * animation.tracks[0].values, atol=1e-8)
    assert np.ptp(led.values) > 0.1


def test_a_leader_that_no_motor_drives_is_refused(tmp_path):
    def edit(stage):
        newton(stage)
        for path in (SHOULDER, ELBOW):
            stage.GetPrimAtPath(path).RemoveAppliedSchema("PhysicsDriveAPI:angular")
            stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION).Clear()

    with pytest.raises(ShotError, match="no motor drives") as caught:
        read(tmp_path, edit)
    assert caught.value.path == ELBOW and caught.value.found == SHOULDER


def test_a_ratio_that_is_not_finite_is_refused(tmp_path):
    with pytest.raises(ShotError, match="not finite") as caught:
        read(tmp_path, lambda s: gear(s, "newton:mimicJoint", newton__mimicCoef1=float("nan")))
    assert caught.value.attribute == "newton:mimicCoef1"


def test_chains_are_multiplied_out_and_circles_refused():
    found = resolve({"/b": Gear("/a", 2.0, 1.0), "/c": Gear("/b", -3.0, 0.5)})
    assert found["/c"] == Gear("/a", -6.0, -2.5)
    with pytest.raises(ShotError, match="circle") as caught:
        resolve({"/a": Gear("/b", 1.0, 0.0), "/b": Gear("/a", 1.0, 0.0)})
    assert "/a -> /b" in caught.value.found or "/b -> /a" in caught.value.found
