"""Rack and pinion joints of PhysX: how far the rack moves, and in which sense, in the simulated world."""

from __future__ import annotations

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from pxr import Gf, Sdf, UsdPhysics
from scipy.spatial.transform import Rotation
from small_shots import BASE, ELBOW, FORE, SHOULDER, TARGET_POSITION, UPPER, Scale, make_target, set_float, write_arm

RACK = "/Arm/joints/rack"
ALONG_Y = Gf.Quatf(0.5**0.5, 0.0, 0.0, 0.5**0.5)  # turns x to y, the axis of the hinge


def undriven(stage, path=ELBOW):
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


def read(tmp_path, edit, scale=None):
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
        undriven(stage, SHOULDER)
        drive = UsdPhysics.DriveAPI.Apply(stage.GetPrimAtPath(ELBOW), "linear").CreateTargetPositionAttr()
        drive.Set(0.0, 0), drive.Set(0.05, 24)

    character, animation, _ = read(tmp_path, edit)
    hinge = next(motor for motor in character.motors if motor.path == SHOULDER)
    assert character.motors[hinge.follows.leader].path == ELBOW
    assert hinge.follows.ratio == pytest.approx(np.radians(500.0))


def test_an_imported_robot_drives_the_pinion_alone(tmp_path):
    robot = write_arm(tmp_path / "arm.usda", lambda s: (slide(s), undriven(s, SHOULDER), rack(s)))
    robots = pytest.importorskip("calmotion_plugins.robot_import")
    made = robots.import_robot(robot, layer=tmp_path / "shot.usda")
    followers = [motor.path for motor in made.character.motors if motor.follows is not None]
    assert len(made.character.motors) == 2 and followers == [ELBOW]


BROKEN = {
    "no motor": (lambda s: (undriven(s, SHOULDER), rack(s)), "no motor drives", "physics:hinge"),
    "a ratio of zero": (lambda s: rack(s, 0.0), "not zero", "physics:ratio"),
    "a hinge as slide": (lambda s: rack(s, joints=(SHOULDER, SHOULDER)), "a hinge and a slide", "physics:prismatic"),
    "rack and pinion exchanged": (lambda s: rack(s, bodies=(FORE, UPPER)), "is the pinion", "physics:body0"),
    "a frame across the hinge": (lambda s: rack(s, turns=(None, None)), "x axis of a frame", "physics:localRot0"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_rack_that_means_nothing_is_refused(tmp_path, name):
    edit, message, attribute = BROKEN[name]
    with pytest.raises(ShotError, match=message) as refused:
        read(tmp_path, lambda stage: (slide(stage), edit(stage)))
    assert refused.value.path == RACK and refused.value.remedy and refused.value.attribute == attribute
