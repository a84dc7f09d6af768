"""Roots that the shot moves, from its transforms to frames over time."""

import numpy as np
import pytest
from calmotion.model import WORLD
from calmotion.usd.reading import read_shot
from pxr import Gf, UsdGeom, UsdPhysics
from scipy.spatial.transform import Rotation
from small_shots import BASE, FRAMES, RATE, Scale, write_arm

STAND = "/Arm/joints/stand"


def sway(stage, path: str, meters: float) -> None:
    """A transform that goes 0.1 m along x and turns by 200 degrees about z over the shot, at frames 0, 12 and 24."""
    prim = UsdGeom.Xformable(stage.GetPrimAtPath(path) or UsdGeom.Xform.Define(stage, path).GetPrim())
    move, turn = prim.AddTranslateOp(opSuffix="moved"), prim.AddRotateZOp(opSuffix="turned")
    for code in (0, 12, 24):
        move.Set(Gf.Vec3d(0.1 * code / FRAMES / meters, 0.0, 0.0), code)
        turn.Set(200.0 * code / FRAMES, code)


def kinematic(stage) -> None:
    stage.GetPrimAtPath(STAND).GetAttribute("physics:jointEnabled").Set(False)
    UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(BASE)).CreateKinematicEnabledAttr(True)


def check(moving, character, meters):
    (frame,) = moving
    joint = character.joints[frame.joint]
    assert joint.body0 == WORLD and character.bodies[joint.body1].path == BASE
    assert frame.times == pytest.approx(np.arange(FRAMES + 1) / RATE)
    share = np.arange(FRAMES + 1) / FRAMES
    assert np.allclose(frame.positions[:, 0], 0.1 * share, atol=1e-6)
    assert np.allclose(frame.positions[0], joint.frame0.position, atol=1e-9)
    turned = Rotation.from_quat(frame.rotations[:, [1, 2, 3, 0]])
    turned = (turned[0].inv() * turned).magnitude()
    assert np.allclose(turned, np.minimum(np.deg2rad(200.0 * share), 2 * np.pi - np.deg2rad(200.0 * share)), atol=1e-5)
    assert np.all(np.sum(frame.rotations[1:] * frame.rotations[:-1], axis=1) > 0.0)


@pytest.mark.parametrize("meters", [1.0, 0.01])
def test_a_kinematic_body_moves_as_its_transform(tmp_path, meters):
    def edit(stage):
        kinematic(stage)
        sway(stage, BASE, meters)

    character, animation, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit, Scale(meters))))
    check(animation.moving, character, meters)
    assert character.joints[animation.moving[0].joint].kind == "fixed"


def test_a_joint_on_a_prim_that_moves_moves_with_it(tmp_path):
    def edit(stage):
        sway(stage, "/Cart", 1.0)
        stand = UsdPhysics.FixedJoint(stage.GetPrimAtPath(STAND))
        stand.GetBody0Rel().SetTargets(["/Cart"])

    character, animation, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    check(animation.moving, character, 1.0)
    assert character.joints[animation.moving[0].joint].path == STAND
    assert any("/Cart" in note and "moves the root of the character" in note for note in character.notes)


def test_a_kinematic_body_that_stands_still_is_held(tmp_path):
    character, animation, _ = read_shot(str(write_arm(tmp_path / "arm.usda", kinematic)))
    assert animation.moving == ()
    assert [joint.body1 for joint in character.joints if joint.body0 == WORLD] == [0]
