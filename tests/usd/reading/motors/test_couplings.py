"""Gear joints of PhysX: which hinge follows, by which ratio, from which pose."""

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from pxr import Gf, Sdf, UsdPhysics
from scipy.spatial.transform import Rotation
from small_shots import BASE, ELBOW, FORE, SHOULDER, TARGET_POSITION, UPPER, Scale, make_target, set_float, write_arm

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


RACK = "/Arm/joints/rack"
ALONG_Y = Gf.Quatf(0.5**0.5, 0.0, 0.0, 0.5**0.5)  # turns x to y, the axis of the hinge


def undriven_rack(stage, path=ELBOW):
    prim = stage.GetPrimAtPath(path)
    prim.RemoveAppliedSchema("PhysicsDriveAPI:angular")
    prim.RemoveProperty(TARGET_POSITION)


def slide(stage, height=0.03, bodies=(BASE, FORE)):
    """The forearm becomes a rack, which slides along x on the base, above the axis of the pinion or below it."""
    stage.RemovePrim(ELBOW)
    joint = UsdPhysics.PrismaticJoint.Define(stage, ELBOW)
    joint.CreateBody0Rel().SetTargets([bodies[0]])
    joint.CreateBody1Rel().SetTargets([bodies[1]])
    joint.CreateAxisAttr("X")
    scale = 1.0 / stage.GetMetadata("metersPerUnit")
    place = Gf.Vec3f(0.1 * scale, 0.0, height * scale)
    side = bodies.index(BASE)
    stage.GetPrimAtPath(ELBOW).GetAttribute(f"physics:localPos{side}").Set(place)
    stage.GetPrimAtPath(FORE).GetAttribute("xformOp:translate").Set(Gf.Vec3d(place) + Gf.Vec3d(0.0, 0.0, scale))


def rack(stage, ratio=500.0, bodies=(UPPER, FORE), joints=(SHOULDER, ELBOW), turns=(ALONG_Y, None)):
    prim = stage.DefinePrim(RACK, "PhysxPhysicsRackAndPinionJoint")
    for k, name in enumerate(("hinge", "prismatic")):
        prim.CreateRelationship(f"physics:body{k}").SetTargets([bodies[k]])
        prim.CreateRelationship(f"physics:{name}").SetTargets([joints[k]])
        if turns[k] is not None:
            prim.CreateAttribute(f"physics:localRot{k}", Sdf.ValueTypeNames.Quatf).Set(turns[k])
    set_float(stage, RACK, "physics:ratio", ratio)


def read_rack(tmp_path, edit, scale=None):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit, scale)))


@pytest.mark.parametrize("bodies", [(BASE, FORE), (FORE, BASE)], ids=["base first", "rack first"])
@pytest.mark.parametrize("height", [0.03, -0.03], ids=["above", "below"])
def test_the_rack_moves_with_the_side_of_the_pinion_that_faces_it(tmp_path, height, bodies):
    # in centimetres; 500 degrees a metre
    def edit(stage):
        slide(stage, height, bodies)
        rack(stage, 5.0)
        make_target(stage)

    shot = cm.open_shot(write_arm(tmp_path / "arm.usda", edit, Scale(0.01, 1.0)))
    result = cm.simulate(shot, step=1.0 / 480, integrator="bdf2", pre_roll=0.0)
    paths = [body.path for body in result.shot.character.bodies]
    motion = result.result.before.motion
    at = motion.rotations[motion.judged][:, paths.index(UPPER)]
    places = motion.positions[motion.judged][:, paths.index(FORE)]
    turned = Rotation.from_quat(np.roll(at, -1, axis=1))
    # what moves the teeth: the velocity of the pinion's rim where it faces the rack, from poses alone
    omega = (turned[2:] * turned[:-2].inv()).as_rotvec() / (result.times[2:] - result.times[:-2])[:, None]
    rim = np.cross(omega, np.array([0.0, 0.0, np.sign(height)]) * 180.0 / np.pi / 500.0)
    speed = (places[2:] - places[:-2]) / (result.times[2:] - result.times[:-2])[:, None]
    assert np.abs(rim[:, 0]).max() > 0.1
    np.testing.assert_allclose(speed, rim, atol=1e-4 * np.abs(rim).max())


def test_the_hinge_follows_where_the_slide_is_driven(tmp_path):
    def edit(stage):
        slide(stage)
        rack(stage)
        undriven_rack(stage, SHOULDER)
        drive = UsdPhysics.DriveAPI.Apply(stage.GetPrimAtPath(ELBOW), "linear").CreateTargetPositionAttr()
        drive.Set(0.0, 0), drive.Set(0.05, 24)

    character, animation, _ = read_rack(tmp_path, edit)
    hinge = next(motor for motor in character.motors if motor.path == SHOULDER)
    assert character.motors[hinge.follows.leader].path == ELBOW
    assert hinge.follows.ratio == pytest.approx(np.radians(500.0))


def test_an_imported_robot_drives_the_pinion_alone(tmp_path):
    robot = write_arm(tmp_path / "arm.usda", lambda s: (slide(s), undriven_rack(s, SHOULDER), rack(s)))
    robots = pytest.importorskip("calmotion_plugins.robot_import")
    made = robots.import_robot(robot, layer=tmp_path / "shot.usda")
    followers = [motor.path for motor in made.character.motors if motor.follows is not None]
    assert len(made.character.motors) == 2 and followers == [ELBOW]


BROKEN_RACK = {
    "no motor": (lambda s: (undriven_rack(s, SHOULDER), rack(s)), "no motor drives", "physics:hinge"),
    "a ratio of zero": (lambda s: rack(s, 0.0), "not zero", "physics:ratio"),
    "a hinge as slide": (lambda s: rack(s, joints=(SHOULDER, SHOULDER)), "a hinge and a slide", "physics:prismatic"),
    "rack and pinion exchanged": (lambda s: rack(s, bodies=(FORE, UPPER)), "is the pinion", "physics:body0"),
    "a frame across the hinge": (lambda s: rack(s, turns=(None, None)), "x axis of a frame", "physics:localRot0"),
}


@pytest.mark.parametrize("name", BROKEN_RACK)
def test_a_rack_that_means_nothing_is_refused(tmp_path, name):
    edit, message, attribute = BROKEN_RACK[name]
    with pytest.raises(ShotError, match=message) as refused:
        read_rack(tmp_path, lambda stage: (slide(stage), edit(stage)))
    assert refused.value.path == RACK and refused.value.remedy and refused.value.attribute == attribute
